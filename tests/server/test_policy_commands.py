"""An ended run's policy: evaluated again and exported, through the API and through the page's forms."""

from __future__ import annotations

import pytest

from labels_db.catalogue import CatalogueEntry
from labels_db.claims import finish_run
from labels_db.models import Command, utc_now
from labels_db.policy_commands import POLICY_COMMANDS, keep_video
from server.command_words import WORDS
from server.policy_view import BUTTONS
from tests.server.conftest import BASE, Site
from tests.web import demo

SAME = {"Origin": BASE}
EVALUATE = {"kind": "evaluate"}
EXPORT = {"kind": "export-policy"}
VIDEO = {"kind": "video"}


@pytest.fixture
def run_id(site: Site) -> str:
    """A finished run with a checkpoint."""
    return finished(site, demo.WINDMILL)


def finished(site: Site, preset: str) -> str:
    with site.database.write() as session:
        held = demo.started(session, demo.queued(session, preset))
        demo.saved(session, held, 40_000)
        finish_run(session, held)
    return held.run_id


def test_every_command_has_a_button_and_words() -> None:
    assert {button.kind for button in BUTTONS} == set(WORDS) == POLICY_COMMANDS


def exported(site: Site, run_id: str, form: str = "onnx") -> Command:
    with site.database.write() as session:
        command = demo.asked_of(session, run_id, "export-policy", format=form)
        demo.exported(session, site.services.store, command, 40_000)
    return command


@pytest.mark.parametrize(
    ("body", "arguments"),
    [
        (EVALUATE, {"episodes": 10}),
        ({**EVALUATE, "episodes": 3}, {"episodes": 3}),
        (VIDEO, {}),
        (EXPORT, {"format": "onnx"}),
        ({**EXPORT, "format": "safetensors"}, {"format": "safetensors"}),
    ],
)
def test_a_command_is_left_for_the_supervisor(
    site: Site, run_id: str, body: dict[str, object], arguments: dict[str, object]
) -> None:
    answer = site.client.post(f"/api/runs/{run_id}/commands", json=body)
    assert answer.status_code == 201
    command = answer.json()
    assert (command["kind"], command["arguments"]) == (body["kind"], arguments)
    assert command["sentence"] == "Waiting for the supervisor."
    assert site.client.get(f"/api/runs/{run_id}/commands").json() == [command]


@pytest.mark.parametrize(
    ("body", "field", "reason"),
    [
        ({}, "kind", "Field required"),
        ({"kind": "delete"}, "kind", "'evaluate', 'video' or 'export-policy'"),
        ({**EVALUATE, "episodes": 0}, "episodes", "greater than or equal to 1"),
        ({**EVALUATE, "episodes": 101}, "episodes", "less than or equal to 100"),
        ({**EXPORT, "format": "pickle"}, "format", "'onnx' or 'safetensors'"),
        ({**EXPORT, "path": "x"}, "path", "not permitted"),
        ({**EXPORT, "episodes": 1}, "body", "export-policy takes no episodes"),
        ({**VIDEO, "episodes": 1}, "body", "video takes no episodes"),
        ({**EVALUATE, "format": "onnx"}, "body", "evaluate takes no format"),
    ],
)
def test_a_wrong_command_is_refused(
    site: Site, run_id: str, body: dict[str, object], field: str, reason: str
) -> None:
    answer = site.client.post(f"/api/runs/{run_id}/commands", json=body)
    assert answer.status_code == 422
    (complaint,) = answer.json()["detail"]
    assert complaint["field"] == field
    assert reason in complaint["reason"]
    assert site.client.get(f"/api/runs/{run_id}/commands").json() == []


def test_only_an_ended_run_with_a_checkpoint_has_a_policy_to_give(site: Site) -> None:
    with site.database.write() as session:
        run = demo.queued(session, demo.WINDMILL)
        held = demo.started(session, run)
        demo.going(session, held)
    path = f"/runs/{run.id}"
    refused = site.client.post(f"/api{path}/commands", json=EVALUATE)
    assert (refused.status_code, "while running" in refused.text) == (409, True)
    assert "Export as ONNX" not in site.client.get(path).text
    with site.database.write() as session:
        finish_run(session, held)
    refused = site.client.post(f"/api{path}/commands", json=EXPORT)
    assert (refused.status_code, "without a checkpoint" in refused.text) == (409, True)
    page = site.client.get(path).text
    assert "no policy to evaluate, watch or export" in page
    assert "Export as ONNX" not in page


def test_a_video_is_made_where_there_is_none(site: Site, run_id: str) -> None:
    assert "Make a video" in site.client.get(f"/runs/{run_id}").text
    with site.database.write() as session:
        keep_video(session, run_id, step=40_000, returns=[1.0], measures={}, video_key="runs/x/1.mp4")
    assert_no_video_is_offered(site, run_id)


def test_what_has_no_picture_is_not_drawn(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    run_id = finished(site, "cartpole-swingup")  # by script: people could not be asked at all
    monkeypatch.setattr(CatalogueEntry, "can_be_drawn", False)
    assert_no_video_is_offered(site, run_id)


def assert_no_video_is_offered(site: Site, run_id: str) -> None:
    refused = site.client.post(f"/api/runs/{run_id}/commands", json=VIDEO)
    assert (refused.status_code, "no video to make" in refused.text) == (409, True)
    page = site.client.get(f"/runs/{run_id}").text
    assert "Export as ONNX" in page
    assert "Make a video" not in page


def test_an_unknown_run_has_no_commands(site: Site) -> None:
    assert site.client.get("/api/runs/nobody/commands").status_code == 404
    assert site.client.post("/api/runs/nobody/commands", json=EVALUATE).status_code == 404


def test_what_came_of_commands_is_told(site: Site, run_id: str) -> None:
    with site.database.write() as session:
        demo.reevaluated(session, demo.asked_of(session, run_id, "evaluate", episodes=10), 40_000)
        demo.done(session, demo.asked_of(session, run_id, "video"), {"step": 40_000})
        demo.asked_of(session, run_id, "evaluate", episodes=5).taken_at = utc_now()
        failed = demo.asked_of(session, run_id, "export-policy", format="safetensors")
        demo.done(session, failed, {"error": "no room left"})
    command = exported(site, run_id)
    listed = site.client.get(f"/api/runs/{run_id}/commands").json()
    assert [each["sentence"] for each in listed] == [
        "The policy after step 40\u202f000, 271 kB.",
        "That did not work: no room left",
        "Evaluating.",
        "A video of the policy after step 40\u202f000.",
        "After step 40\u202f000: true return 812.3 over 10 episodes, largest tilt 4.",
    ]
    assert listed[0]["download_url"] == f"/runs/{run_id}/exports/{command.id}"
    assert "artifact" not in listed[0]["result"]
    assert (listed[1]["result"], listed[1]["error"]) == (None, "no room left")
    assert listed[4]["result"]["return"] == pytest.approx(812.34)


def test_only_the_latest_twenty_are_listed(site: Site, run_id: str) -> None:
    for _ in range(21):
        last = site.client.post(f"/api/runs/{run_id}/commands", json=EVALUATE).json()
    listed = site.client.get(f"/api/runs/{run_id}/commands").json()
    assert (len(listed), listed[0]) == (20, last)


@pytest.mark.parametrize("form", ["onnx", "safetensors"])
def test_an_export_is_downloaded_as_a_file(site: Site, run_id: str, form: str) -> None:
    url = f"/runs/{run_id}/exports/{exported(site, run_id, form).id}"
    answer = site.client.get(url)
    assert (answer.status_code, answer.content) == (200, b"policy")
    name = f'attachment; filename="{run_id}-step-40000.{form}"'
    assert answer.headers["content-disposition"] == name
    assert site.anonymous.get(url).status_code == 401


def test_a_damaged_export_is_not_served(site: Site, run_id: str) -> None:
    command = exported(site, run_id)
    assert command.result is not None
    site.services.store.write(command.result["artifact"], b"something else")
    answer = site.client.get(f"/runs/{run_id}/exports/{command.id}")
    assert answer.status_code == 404
    assert "damaged" in answer.text


def test_what_exported_nothing_has_no_file(site: Site, run_id: str) -> None:
    command = exported(site, run_id)
    with site.database.write() as session:
        waiting = demo.asked_of(session, run_id, "export-policy", format="onnx").id
        other = demo.queued(session, demo.WINDMILL).id
    for path, status in (
        (f"{run_id}/exports/{waiting}", 404),
        (f"{run_id}/exports/{command.id + 99}", 404),
        (f"{run_id}/exports/..%2f..%2ftoken", 404),
        (f"{run_id}/exports/policy.onnx", 422),
        (f"{other}/exports/{command.id}", 404),
    ):
        assert site.client.get(f"/runs/{path}").status_code == status, path


def test_the_page_asks_and_tells_without_scripts(site: Site, run_id: str) -> None:
    page, more = f"/runs/{run_id}", {"kind": "evaluate", "episodes": "10"}
    answer = site.client.post(f"{page}/commands", data={**more, "back": f"{page}#ask"}, headers=SAME)
    assert (answer.status_code, answer.headers["location"]) == (303, f"{page}#ask")
    text = site.client.get(page).text
    assert text.count("Waiting for the supervisor.") == 1
    assert "For any ONNX runtime." in text
    command = exported(site, run_id)
    assert f'href="{page}/exports/{command.id}"' in site.client.get(page).text
    assert site.client.post(f"{page}/commands", data={"kind": "x"}, headers=SAME).status_code == 422
