"""Who may answer and take back what: whose lease, which run, and what was on screen."""

from __future__ import annotations

from typing import Any

from fastapi.testclient import TestClient

from labels_db.data_folder import DataFolder
from tests.labelling_rig import LabelRun
from tests.server.labelling_client import RUN, answer, client, lease, new_id, reason


def test_somebody_elses_lease_is_refused(run: LabelRun, ann: TestClient, bob: TestClient) -> None:
    run.post(1)
    [lent] = lease(ann)
    assert lease(bob) == []
    assert answer(bob, lent["lease_id"]).status_code == 404
    assert bob.post(f"{RUN}/leases/{lent['lease_id']}/release").status_code == 404
    assert run.answers() == []


def seen(lent: dict[str, Any]) -> list[str]:
    return [lent[side]["url"] for side in ("left", "right")]


def test_who_tells_what_was_on_screen_speaks_for_whom_it_was_lent_to(
    run: LabelRun, ann: TestClient, bob: TestClient
) -> None:
    """The name that a browser goes by may have changed since."""
    run.post(1)
    [lent] = lease(ann)
    given = answer(bob, lent["lease_id"], seen=seen(lent))
    assert given.status_code == 200
    assert [row.labeller_id for row in run.answers()] == [row.labeller_id for row in run.leases()]
    taken_back = {"retraction_id": new_id(), "seen": seen(lent)}
    path = f"{RUN}/answers/{given.json()['answer']['answer_id']}/retract"
    again = bob.post(path, json=taken_back).json()["lease"]
    assert bob.post(path, json=taken_back).json()["lease"] == again
    assert answer(bob, again["lease_id"], "equal", seen=seen(again)).status_code == 200
    assert set(run.standing().values()) == {"equal"}
    assert len({row.labeller_id for row in run.answers()}) == 1


def test_an_answer_to_a_run_of_that_name_elsewhere_is_told_apart(run: LabelRun, ann: TestClient) -> None:
    """A page keeps it: its run is not here."""
    run.post(1)
    [lent] = lease(ann)
    life = ann.get(f"{RUN}/queue").json()["life"]
    refused = answer(ann, lent["lease_id"], seen=seen(lent), life=f"{life}1")
    assert (refused.status_code, reason(refused)["field"]) == (404, "run_id")
    given = answer(ann, lent["lease_id"], seen=seen(lent), life=life).json()["answer"]["answer_id"]
    wish = {"retraction_id": new_id(), "life": f"{life}1"}
    refused = ann.post(f"{RUN}/answers/{given}/retract", json=wish)
    assert (refused.status_code, reason(refused)["field"]) == (404, "run_id")
    assert len(run.standing()) == 1


def test_an_answer_to_another_pair_than_the_lease_s_is_refused(run: LabelRun, ann: TestClient) -> None:
    """A backup brought back gives out the numbers of leases again."""
    run.post(2)
    one, two = lease(ann, 2)
    refused = answer(ann, one["lease_id"], seen=seen(two))
    assert (refused.status_code, "another pair" in reason(refused)["reason"]) == (409, True)
    assert answer(ann, one["lease_id"], seen=seen(one)[::-1]).status_code == 409
    answered = answer(ann, one["lease_id"], seen=seen(one)).json()["answer"]["answer_id"]
    wish = {"retraction_id": new_id(), "seen": seen(two)}
    assert ann.post(f"{RUN}/answers/{answered}/retract", json=wish).status_code == 409
    assert len(run.standing()) == 1


def test_a_lease_of_another_run_is_refused(run: LabelRun, ann: TestClient) -> None:
    LabelRun(run.database, run.store, run_id="other").begin()
    run.post(1)
    [lent] = lease(ann)
    body = {"answer_id": new_id(), "lease_id": lent["lease_id"], "pressed": "left"}
    refused = ann.post("/api/runs/other/answers", json=body)
    assert refused.status_code == 404
    assert reason(refused)["field"] == "lease_id"
    assert "not of run other" in reason(refused)["reason"]


def test_a_missing_run_is_told_apart_from_a_missing_lease_or_answer(run: LabelRun, ann: TestClient) -> None:
    """A page keeps an answer whose run is not here, and gives one up whose lease is not."""
    wish = {"retraction_id": new_id()}
    given = {"answer_id": new_id(), "lease_id": 12345, "pressed": "left"}
    for path, body, field in (
        ("nosuch/answers", given, "run_id"),
        (f"nosuch/answers/{new_id()}/retract", wish, "run_id"),
        (f"{run.run_id}/answers", given, "lease_id"),
        (f"{run.run_id}/answers/{new_id()}/retract", wish, "answer_id"),
    ):
        refused = ann.post(f"/api/runs/{path}", json=body)
        assert refused.status_code == 404
        assert reason(refused)["field"] == field


def test_only_ones_own_answers_can_be_taken_back(run: LabelRun, ann: TestClient, bob: TestClient) -> None:
    run.post(1)
    [lent] = lease(ann)
    answered = answer(ann, lent["lease_id"]).json()["answer"]["answer_id"]
    wish = {"retraction_id": new_id()}
    assert bob.post(f"{RUN}/answers/{answered}/retract", json=wish).status_code == 404
    assert ann.post(f"{RUN}/answers/{new_id()}/retract", json=wish).status_code == 404
    taken = {"retraction_id": answered}
    assert ann.post(f"{RUN}/answers/{answered}/retract", json=taken).status_code == 409
    assert len(run.standing()) == 1


def test_two_people_never_hold_one_pair(run: LabelRun, ann: TestClient, bob: TestClient) -> None:
    run.post(3)
    held = [given["query_id"] for who in (ann, bob) for given in lease(who, 2)]
    assert len(held) == len(set(held)) == 3


def test_a_browser_is_one_labeller_until_it_is_named(run: LabelRun, data: DataFolder) -> None:
    run.post(1)
    with client(data, "") as browser:
        made_up = browser.get("/api/labeller").json()
        assert not made_up["named"]
        [lent] = lease(browser)
        assert browser.get("/api/labeller").json()["name"] == made_up["name"]
        named = browser.put("/api/labeller", json={"name": " Ada "}).json()
        assert named == {"name": "Ada", "named": True}
        # A made-up name is replaced, so the pair is still hers.
        assert [given["lease_id"] for given in lease(browser)] == [lent["lease_id"]]
        assert browser.put("/api/labeller", json={"name": "Ben"}).json()["name"] == "Ben"
        assert [given["query_id"] for given in lease(browser)] == [lent["query_id"]]
        assert answer(browser, lent["lease_id"]).status_code == 404
        assert reason(browser.put("/api/labeller", json={"name": "  "}))["field"] == "name"
