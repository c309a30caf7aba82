"""The API for starting and steering runs: every route, and every way to be refused."""

from __future__ import annotations

from typing import Any

import pytest

from labels_db.claims import finish_run
from labels_db.models import RunState
from labels_db.runs import get_run
from tests.server.conftest import Site
from tests.web import demo

WINDMILL = {"preset": demo.WINDMILL}


def created(site: Site, **more: Any) -> dict[str, Any]:
    answer = site.client.post("/api/runs", json={**WINDMILL, **more})
    assert answer.status_code == 201, answer.text
    return dict(answer.json())


def complaint(site: Site, status: int, path: str, body: Any) -> tuple[str, str]:
    answer = site.client.post(path, json=body)
    assert answer.status_code == status, answer.text
    (only,) = answer.json()["detail"]
    return only["field"], only["reason"]


def test_presets_are_listed_with_their_settings(site: Site) -> None:
    listed = site.client.get("/api/presets").json()
    assert demo.WINDMILL in [preset["name"] for preset in listed]
    shown = site.client.get("/api/presets/walker-walk?profile=paper").json()
    fields = {field["path"]: field for field in shown["fields"]}
    assert shown["profile"] == "paper"
    assert shown["bytes"] > 0
    assert fields["feedback.budget"]["value"] == 1400
    assert fields["feedback.budget"]["minimum"] == 1
    assert fields["feedback.teacher.kind"]["primary"] is True
    assert set(fields["feedback.teacher.kind"]["choices"]) >= {"human", "oracle"}


@pytest.mark.parametrize(
    ("path", "field"), [("/api/presets/walk", "preset"), ("/api/presets/walker-walk?profile=x", "profile")]
)
def test_unknown_presets_are_named(site: Site, path: str, field: str) -> None:
    answer = site.client.get(path)
    assert answer.status_code == 422
    assert answer.json()["detail"][0]["field"] == field


def test_a_run_is_queued_with_its_settings(site: Site) -> None:
    run = created(site, title=" Mine ", goal="Spin", settings={"feedback.budget": "40", "seed": "7"})
    assert (run["title"], run["goal"]["text"], run["state"]) == ("Mine", "Spin", "queued")
    assert run["sentence"] == "Next in the queue."
    assert run["feedback"]["budget"] == 40
    assert run["queue_position"] == 1
    assert site.client.get(f"/api/runs/{run['id']}").json() == run
    assert site.client.get("/api/runs").json() == [run]
    config = site.client.get(f"/api/runs/{run['id']}/config")
    assert config.json()["seed"] == 7
    assert run["id"] in config.headers["content-disposition"]


@pytest.mark.parametrize(
    ("body", "field", "reason"),
    [
        ({}, "preset", "Field required"),
        ({"preset": "windmil"}, "preset", "unknown"),
        ({**WINDMILL, "profile": "huge"}, "profile", "laptop"),
        (
            {**WINDMILL, "settings": {"feedback.budget": "0"}},
            "feedback.budget",
            "must be at least 1, not '0'",
        ),
        ({**WINDMILL, "settings": {"seed": "x"}}, "seed", "needs a whole number"),
        ({**WINDMILL, "settings": {"sead": "1"}}, "sead", "did you mean seed?"),
        ({**WINDMILL, "settings": {"reward.kind": "true"}}, "", "set feedback.kind to 'none'"),
        ({**WINDMILL, "settings": {"seed": 1}}, "settings.seed", "string"),
        ({**WINDMILL, "title": "  "}, "title", "at least 1"),
        ({**WINDMILL, "title": "a\x00b"}, "title", "control characters"),
        ({**WINDMILL, "goal": "x" * 1001}, "goal", "at most 1000"),
        ({**WINDMILL, "colour": "red"}, "colour", "not permitted"),
        ([], "body", "valid dictionary"),
    ],
)
def test_a_wrong_run_is_refused_with_field_and_reason(site: Site, body: Any, field: str, reason: str) -> None:
    found = complaint(site, 422, "/api/runs", body)
    assert found[0] == field
    assert reason in found[1]
    assert site.client.get("/api/runs").json() == []


def test_broken_json_is_refused(site: Site) -> None:
    answer = site.client.post("/api/runs", content=b"{", headers={"Content-Type": "application/json"})
    assert answer.status_code == 422
    assert "JSON" in answer.json()["detail"][0]["reason"]


def test_a_run_is_paused_resumed_and_stopped(site: Site) -> None:
    run_id = created(site)["id"]
    with site.database.write() as session:
        demo.going(session, demo.started(session, get_run(session, run_id)))
    for action, desired in (("pause", "pause"), ("resume", "run"), ("stop", "stop")):
        answer = site.client.post(f"/api/runs/{run_id}/{action}")
        assert (answer.status_code, answer.json()["desired"]) == (200, desired)


def test_what_the_state_does_not_allow_is_a_conflict(site: Site) -> None:
    run_id = created(site)["id"]
    for action in ("pause", "resume"):
        field, reason = complaint(site, 409, f"/api/runs/{run_id}/{action}", None)
        assert field == ""
        assert f"cannot {action} while queued" in reason


def test_a_finished_run_is_extended_and_queued_again(site: Site) -> None:
    run_id = created(site)["id"]
    with site.database.write() as session:
        finish_run(session, demo.started(session, get_run(session, run_id)))
    run = site.client.post(f"/api/runs/{run_id}/extend", json={"total_steps": 80_000, "budget": 60}).json()
    assert (run["total_steps"], run["feedback"]["budget"], run["state"]) == (80_000, 60, RunState.QUEUED)


def test_a_run_cannot_shrink(site: Site) -> None:
    run_id = created(site)["id"]
    path = f"/api/runs/{run_id}/extend"
    assert "already has 50" in complaint(site, 409, path, {"budget": 10})[1]
    assert complaint(site, 422, path, {"budget": 0})[0] == "budget"
    assert complaint(site, 422, path, {"total_steps": 10**12})[0] == "total_steps"
    assert complaint(site, 422, path, {"total_steps": "many"})[0] == "total_steps"


def test_the_goal_gets_a_new_version(site: Site) -> None:
    path = f"/api/runs/{created(site)['id']}/goal"
    assert site.client.post(path, json={"text": "Slower"}).json()["version"] == 2
    assert site.client.post(path, json={"text": "Slower"}).json()["version"] == 2
    assert complaint(site, 422, path, {"text": ""})[0] == "text"


@pytest.mark.parametrize("action", ["pause", "resume", "stop", "extend", "goal"])
def test_steering_an_unknown_run_is_not_found(site: Site, action: str) -> None:
    field, reason = complaint(
        site, 404, f"/api/runs/nobody/{action}", {"text": "x"} if action == "goal" else {}
    )
    assert field == "run_id"
    assert "'nobody'" in reason


def test_unknown_addresses_and_methods_are_answered_in_json(site: Site) -> None:
    assert site.client.get("/api/nothing").json()["detail"][0]["reason"]
    assert site.client.delete("/api/runs").status_code == 405
    assert site.client.get("/docs").status_code == 404


def test_the_api_describes_itself(site: Site) -> None:
    document = site.client.get("/api/openapi.json").json()
    operations = [
        (path, operation) for path, methods in document["paths"].items() for operation in methods.values()
    ]
    assert {path for path, _ in operations} >= {"/api/runs", "/api/runs/{run_id}/extend", "/api/presets"}
    for path, operation in operations:
        assert path.startswith("/api/")
        assert operation["tags"], path
        assert operation["description"], path
        for status, response in operation["responses"].items():
            if status >= "400":
                schema = response["content"]["application/json"]["schema"]
                assert schema == {"$ref": "#/components/schemas/Complaints"}, (path, status)


def test_every_schema_of_the_api_has_a_name_of_its_own(site: Site) -> None:
    """Two models of one name are told apart by their modules' names, which are nobody's business."""
    schemas = site.client.get("/api/openapi.json").json()["components"]["schemas"]
    assert not [name for name in schemas if "__" in name]
