"""The dashboard and a run's page in every state, and their buttons without scripts."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from labels_db.data_folder import DataFolder
from labels_db.runs import get_run
from server.app import create_app
from server.token import access_token
from tests.server.conftest import BASE, Site
from tests.web import demo

SAME = {"Origin": BASE}
STATES = ("finished", "failed", "stopped", "paused", "waiting", "teaching", "queued")


@pytest.fixture(scope="module")
def populated(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[TestClient, dict[str, str]]]:
    data = DataFolder(Path(tmp_path_factory.mktemp("populated")))
    database = data.open_database()
    ids = demo.populate(data, database)
    database.close()
    bearer = {"Authorization": f"Bearer {access_token(data)}"}
    with TestClient(create_app(data), base_url=BASE, headers=bearer) as client:
        yield client, ids


def test_a_new_installation_says_what_this_is(site: Site) -> None:
    page = site.client.get("/").text
    assert "Teach a robot by choosing" in page
    assert page.count('class="button primary"') == 1


def test_the_dashboard_shows_every_run(populated: tuple[TestClient, dict[str, str]]) -> None:
    client, ids = populated
    page = client.get("/").text
    for run_id in ids.values():
        assert f'href="/runs/{run_id}"' in page
    for words in ("Waiting for 6 answers.", "Next in the queue.", "Second in the queue.", "687.4"):
        assert words in page


@pytest.mark.parametrize("state", STATES)
def test_every_state_has_a_page_without_raw_values(
    populated: tuple[TestClient, dict[str, str]], state: str
) -> None:
    client, ids = populated
    answer = client.get(f"/runs/{ids[state]}")
    assert answer.status_code == 200
    for raw in (">None<", "null", "true_return", "RunState"):
        assert raw not in answer.text


def test_a_failure_shows_its_error_and_the_end_of_the_log(
    populated: tuple[TestClient, dict[str, str]],
) -> None:
    client, ids = populated
    page = client.get(f"/runs/{ids['failed']}").text
    assert "What went wrong" in page
    assert page.count("OutOfMemoryError") == 2
    assert "Resume" in page


def test_answers_show_stills_and_what_the_model_says(
    populated: tuple[TestClient, dict[str, str]],
) -> None:
    client, ids = populated
    page = client.get(f"/runs/{ids['teaching']}").text
    assert 'aria-label="First clip, chosen"' in page
    assert "The model agrees" in page
    assert "4 pairs wait for an answer." in page


def test_an_older_video_is_shown_without_scripts(populated: tuple[TestClient, dict[str, str]]) -> None:
    client, ids = populated
    page = client.get(f"/runs/{ids['teaching']}?video=4000").text
    assert f'src="/runs/{ids["teaching"]}/videos/4000.mp4"' in page
    assert "After step 4\u202f000" in page


def test_the_buttons_steer_and_come_back(site: Site) -> None:
    with site.database.write() as session:
        run = demo.queued(session, demo.WINDMILL)
        demo.going(session, demo.started(session, run))
    for action, sentence in (
        ("pause", "Pausing at step 12\u202f400."),
        ("resume", "Training:"),
        ("stop", "Stopping at step 12\u202f400"),
    ):
        answer = site.client.post(f"/runs/{run.id}/{action}", data={"back": f"/runs/{run.id}"}, headers=SAME)
        assert (answer.status_code, answer.headers["location"]) == (303, f"/runs/{run.id}")
        assert sentence in site.client.get(f"/runs/{run.id}").text


def test_extending_and_rewording(site: Site) -> None:
    with site.database.write() as session:
        run = demo.queued(session, demo.WINDMILL)
    page = f"/runs/{run.id}"
    assert site.client.post(f"{page}/extend", data={"total_steps": "50000"}, headers=SAME).status_code == 303
    assert site.client.post(f"{page}/goal", data={"text": "Slower"}, headers=SAME).status_code == 303
    with site.database.read() as session:
        found = get_run(session, run.id)
        assert (found.config["total_steps"], found.goal_cards[-1].text) == (50_000, "Slower")
    assert site.client.post(f"{page}/extend", data={"total_steps": "1"}, headers=SAME).status_code == 409
    assert site.client.post(f"{page}/extend", data={"total_steps": "x"}, headers=SAME).status_code == 422
    assert site.client.post(f"{page}/goal", data={"text": " "}, headers=SAME).status_code == 422


def test_what_cannot_be_done_now_says_so(site: Site) -> None:
    with site.database.write() as session:
        run = demo.queued(session, demo.WINDMILL)
    answer = site.client.post(f"/runs/{run.id}/pause", headers=SAME)
    assert answer.status_code == 409
    assert "Not now" in answer.text


def test_a_missing_run_gets_a_page(site: Site) -> None:
    answer = site.client.get("/runs/nobody")
    assert answer.status_code == 404
    assert "Nothing here" in answer.text
