"""The labelling API: lease, answer, retract, release, and what they refuse."""

from __future__ import annotations

import re
from typing import Any

import pytest
from fastapi.testclient import TestClient
from hypothesis import given, settings
from hypothesis import strategies as st

from labels_db.answers import choice_of
from labels_db.models import Choice, Pressed, RunState
from tests.labelling_rig import GOAL, LabelRun, has_true_return
from tests.server.labelling_client import RUN, answer, lease, new_id, reason


def test_a_lease_has_two_clips_and_nothing_that_leads(run: LabelRun, ann: TestClient) -> None:
    run.post(3)
    reply = ann.post(f"{RUN}/leases", json={"count": 2})
    leases, queue = reply.json()["leases"], reply.json()["queue"]
    assert [set(lent) for lent in leases] == [{"lease_id", "query_id", "expires_at", "left", "right"}] * 2
    assert set(leases[0]["left"]) == {
        *("url", "frames", "rows", "columns", "width", "height", "duration", "times")
    }
    assert len(leases[0]["left"]["times"]) == leases[0]["left"]["frames"] == 25
    assert (queue["goal"]["version"], queue["goal"]["text"]) == (1, GOAL)
    assert (queue["given"], queue["budget"], queue["open"], queue["available"]) == (0, 50, 3, 3)
    assert not has_true_return(reply.text)


def test_sides_are_swapped_as_the_lease_says(run: LabelRun, ann: TestClient) -> None:
    run.post(1)
    [before] = lease(ann)
    run.swap(0, swapped=False)
    [straight] = lease(ann)
    run.swap(0, swapped=True)
    [swapped] = lease(ann)
    assert straight["lease_id"] == swapped["lease_id"] == before["lease_id"]
    assert (straight["left"], straight["right"]) == (swapped["right"], swapped["left"])
    first, second = run.leases()[0].query.first_id, run.leases()[0].query.second_id
    assert straight["left"]["url"].startswith(f"/artifacts/clips/{first}?")
    assert swapped["left"]["url"].startswith(f"/artifacts/clips/{second}?")


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("pressed", ["left", "right", "equal", "skip"])
def test_an_answer_is_recorded_in_the_querys_own_order(
    run: LabelRun, ann: TestClient, swapped: bool, pressed: str
) -> None:
    run.post(1)
    [lent] = lease(ann)
    run.swap(0, swapped=swapped)
    reply = answer(ann, lent["lease_id"], pressed, shown_at="2026-03-01T12:00:00+02:00")
    assert reply.status_code == 200, reply.text
    assert reply.json()["answer"]["pressed"] == pressed
    [recorded] = run.answers()
    straight = {"left": "first", "right": "second", "equal": "equal", "skip": "skip"}
    turned = {**straight, "left": "second", "right": "first"}
    assert recorded.choice == (turned if swapped else straight)[pressed]
    assert recorded.shown_at is not None
    assert (recorded.shown_at.hour, recorded.goal_card_version) == (10, 1)


@given(pressed=st.sampled_from(Pressed))
@settings(max_examples=10)
def test_turning_the_sides_round_turns_the_choice_round(pressed: Pressed) -> None:
    turned = {Choice.FIRST: Choice.SECOND, Choice.SECOND: Choice.FIRST}
    straight = choice_of(pressed, swapped=False)
    assert choice_of(pressed, swapped=True) == turned.get(straight, straight)


def test_an_answer_brings_the_next_leases(run: LabelRun, ann: TestClient) -> None:
    run.post(3)
    [lent] = lease(ann)
    reply = answer(ann, lent["lease_id"], count=2).json()
    assert len(reply["leases"]) == 2
    assert lent["lease_id"] not in [next_lease["lease_id"] for next_lease in reply["leases"]]
    assert reply["queue"]["given"] == 1
    assert not has_true_return(str(reply))


def test_the_same_answer_again_changes_nothing(run: LabelRun, ann: TestClient) -> None:
    run.post(2)
    [lent] = lease(ann)
    body = {"answer_id": new_id(), "lease_id": lent["lease_id"], "pressed": "left"}
    first = ann.post(f"{RUN}/answers", json=body)
    again = ann.post(f"{RUN}/answers", json={**body, "pressed": "right"})
    assert first.json()["answer"] == again.json()["answer"]
    assert len(run.answers()) == 1


def test_a_lease_is_answered_once(run: LabelRun, ann: TestClient) -> None:
    run.post(1)
    [lent] = lease(ann)
    assert answer(ann, lent["lease_id"]).status_code == 200
    refused = answer(ann, lent["lease_id"])
    assert refused.status_code == 409
    assert f"lease {lent['lease_id']}: already answered" in reason(refused)["reason"]


def test_an_answer_id_serves_one_lease(run: LabelRun, ann: TestClient) -> None:
    run.post(2)
    one, two = lease(ann, 2)
    body = {"answer_id": new_id(), "pressed": "left"}
    assert ann.post(f"{RUN}/answers", json={**body, "lease_id": one["lease_id"]}).status_code == 200
    assert ann.post(f"{RUN}/answers", json={**body, "lease_id": two["lease_id"]}).status_code == 409


def test_releasing_lets_others_have_the_pair(run: LabelRun, ann: TestClient, bob: TestClient) -> None:
    run.post(1)
    [lent] = lease(ann)
    assert ann.post(f"{RUN}/leases/{lent['lease_id']}/release").status_code == 204
    assert [given["query_id"] for given in lease(bob)] == [lent["query_id"]]


def test_a_released_pair_comes_back_on_the_same_sides(run: LabelRun, ann: TestClient) -> None:
    run.post(1)
    [lent] = lease(ann)
    ann.post(f"{RUN}/leases/{lent['lease_id']}/release")
    [again] = lease(ann)
    assert (again["lease_id"], again["left"]) == (lent["lease_id"], lent["left"])


def test_a_retraction_lends_the_pair_again_on_the_same_sides(run: LabelRun, ann: TestClient) -> None:
    run.post(2)
    [lent] = lease(ann)
    answered = answer(ann, lent["lease_id"]).json()["answer"]["answer_id"]
    wish = {"retraction_id": new_id()}
    reply = ann.post(f"{RUN}/answers/{answered}/retract", json=wish).json()
    assert reply["retraction"]["answer_id"] == answered
    assert (reply["lease"]["left"], reply["lease"]["right"]) == (lent["left"], lent["right"])
    assert reply["queue"]["given"] == 0
    assert run.standing() == {}
    again = ann.post(f"{RUN}/answers/{answered}/retract", json=wish).json()
    assert (again["retraction"], again["lease"]["lease_id"]) == (
        reply["retraction"],
        reply["lease"]["lease_id"],
    )
    assert len(run.answers()) == 2
    assert answer(ann, reply["lease"]["lease_id"], "right").status_code == 200
    assert len(run.standing()) == 1
    assert not has_true_return(str(reply))


def test_an_archived_run_takes_no_answers(run: LabelRun, ann: TestClient) -> None:
    run.post(2)
    [lent] = lease(ann)
    answered = answer(ann, lent["lease_id"]).json()
    run.archive()
    for reply in (
        ann.post(f"{RUN}/leases", json={"count": 1}),
        answer(ann, answered["leases"][0]["lease_id"]),
        ann.post(
            f"{RUN}/answers/{answered['answer']['answer_id']}/retract", json={"retraction_id": new_id()}
        ),
    ):
        assert reply.status_code == 409
        assert "archived" in reason(reply)["reason"]
    assert ann.get(f"{RUN}/queue").json()["message"]["kind"] == "archived"


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"pressed": "first"}, "pressed"),
        ({"pressed": ""}, "pressed"),
        ({"answer_id": "7"}, "answer_id"),
        ({"lease_id": 0}, "lease_id"),
        ({"lease_id": 2**70}, "lease_id"),
        ({"shown_at": "yesterday"}, "shown_at"),
        ({"shown_at": "2026-03-01T12:00:00"}, "shown_at"),
        ({"shown_at": "0001-01-01T00:00:00+14:00"}, "shown_at"),
        ({"count": 9}, "count"),
        ({"choice": "first"}, "choice"),
    ],
)
def test_bad_answers_are_refused_by_field(
    run: LabelRun, ann: TestClient, change: dict[str, Any], field: str
) -> None:
    run.post(1)
    [lent] = lease(ann)
    good = {"answer_id": new_id(), "lease_id": lent["lease_id"], "pressed": "left"}
    refused = ann.post(f"{RUN}/answers", json={**good, **change})
    assert refused.status_code == 422
    assert reason(refused)["field"] == field
    assert reason(refused)["reason"]
    assert run.answers() == []


def test_an_unknown_run_is_named(ann: TestClient) -> None:
    for reply in (
        ann.post("/api/runs/nosuch/leases", json={}),
        ann.get("/api/runs/nosuch/queue"),
        ann.get("/runs/nosuch/label"),
    ):
        assert reply.status_code == 404
        assert "nosuch" in reply.text


def test_looking_at_the_queue_leases_nothing(run: LabelRun, ann: TestClient) -> None:
    run.post(2)
    assert ann.get(f"{RUN}/queue").json()["available"] == 2
    assert run.leases() == []


def test_the_queue_tells_why_it_is_empty(run: LabelRun, ann: TestClient) -> None:
    run.close_session()
    run.says(step=5000, next_session_step=7000)
    reply = ann.post(f"{RUN}/leases", json={}).json()
    assert reply["leases"] == []
    assert reply["queue"]["message"]["kind"] == "training"
    said = reply["queue"]["message"]["sentence"]
    assert re.fullmatch(r"The agent is training: next pairs in about (1\d|20) s\.", said)
    run.says(RunState.PAUSED)
    assert ann.get(f"{RUN}/queue").json()["message"]["kind"] == "paused"


def test_the_actions_are_described_with_what_they_refuse(ann: TestClient) -> None:
    paths = ann.get("/api/openapi.json").json()["paths"]
    base = "/api/runs/{run_id}"
    actions = [f"{base}/leases", f"{base}/answers", f"{base}/answers/{{answer_id}}/retract"]
    for action in actions:
        assert {"400", "401", "403", "404", "409", "413", "422"} <= set(paths[action]["post"]["responses"])
    assert not any("label" in path and "/api" not in path for path in paths)
