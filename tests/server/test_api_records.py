"""The API for what a run has recorded."""

from __future__ import annotations

from pathlib import Path

import pytest

from labels_db.claims import Claim
from labels_db.feedback_sessions import session_queries
from labels_db.records import Measurement, record_metrics
from tests.server.conftest import Site
from tests.web import demo

RECORDS = ("metrics", "evaluations", "fits", "queries", "answers", "events", "log")


@pytest.fixture
def run(site: Site) -> str:
    """A run that has lived a little: a session of two pairs, both answered, one fit, one evaluation."""
    with site.database.write() as session:
        run = demo.queued(session, demo.WINDMILL)
        held = demo.started(session, run)
        opened = demo.posted(session, site.services.store, held, index=0, count=2)
        demo.answered(session, run.id, 2)
        demo.fitted(session, held, 0, {query.id: 0.75 for query in session_queries(session, opened.id)})
        demo.curves(session, held, 5000)
        demo.evaluated(session, site.services.store, held, range(5000, 5001, 5000))
        demo.going(session, held, step=5000)
    return run.id


def test_metrics_come_by_name_and_after_a_step(site: Site, run: str) -> None:
    path = f"/api/runs/{run}/metrics"
    everything = site.client.get(path).json()
    assert set(everything["series"]) == {"episode_return", "steps_per_second"}
    assert everything["attempt"] == 1
    some = site.client.get(f"{path}?since=3000&names=episode_return").json()["series"]
    assert list(some) == ["episode_return"]
    assert some["episode_return"]["steps"] == [4000, 5000]
    assert site.client.get(f"{path}?names=nothing").json()["series"] == {}


def test_without_names_every_metric_comes(site: Site, run: str) -> None:
    """What an agent measures of itself is its own affair: these are PPO's."""
    with site.database.write() as session:
        names = ["policy_gradient_loss", "batch_reward"]
        record_metrics(session, Claim(run, 1), [Measurement(5000, name, 0.5) for name in names])
    series = site.client.get(f"/api/runs/{run}/metrics").json()["series"]
    assert set(series) == {*names, "episode_return", "steps_per_second"}
    chosen = site.client.get(f"/api/runs/{run}/metrics", params={"names": names[0]}).json()["series"]
    assert chosen == {names[0]: {"steps": [5000], "values": [0.5]}}


def test_evaluations_name_their_videos(site: Site, run: str) -> None:
    (evaluation,) = site.client.get(f"/api/runs/{run}/evaluations").json()
    assert evaluation["video_url"] == f"/runs/{run}/videos/5000.mp4"
    assert site.client.get(evaluation["video_url"]).status_code == 200


def test_fits_queries_answers_and_events(site: Site, run: str) -> None:
    (fit,) = site.client.get(f"/api/runs/{run}/fits").json()
    assert fit["preferences"] == 10
    queries = site.client.get(f"/api/runs/{run}/queries").json()
    assert [query["state"] for query in queries] == ["closed", "closed"]
    answers = site.client.get(f"/api/runs/{run}/answers?limit=1").json()
    assert [(a["sequence"], a["labeller"], a["probability"]) for a in answers] == [(2, "Ada", 0.75)]
    assert "true_return" not in site.client.get(f"/api/runs/{run}/queries").text
    events = site.client.get(f"/api/runs/{run}/events").json()
    assert [event["text"] for event in events] == ["Attempt 1 starts.", "Asked for."]


def test_the_log_ends_where_the_file_does(site: Site, run: str) -> None:
    assert site.client.get(f"/api/runs/{run}/log").json() == {"lines": []}
    path: Path = site.data.log_path(run)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"\xff" + b"x" * 100_000 + b"\nsecond\nlast\n")
    assert site.client.get(f"/api/runs/{run}/log?lines=1").json() == {"lines": ["last"]}
    assert site.client.get(f"/api/runs/{run}/log").json() == {"lines": ["second", "last"]}


@pytest.mark.parametrize("record", RECORDS)
def test_unknown_runs_are_not_found(site: Site, record: str) -> None:
    assert site.client.get(f"/api/runs/nobody/{record}").status_code == 404


@pytest.mark.parametrize(
    "wrong",
    ["answers?limit=0", "answers?limit=x", "metrics?since=x", f"metrics?since={2**70}", "log?lines=-1"],
)
def test_wrong_questions_are_refused(site: Site, run: str, wrong: str) -> None:
    answer = site.client.get(f"/api/runs/{run}/{wrong}")
    assert answer.status_code == 422
    assert answer.json()["detail"][0]["field"] in wrong
