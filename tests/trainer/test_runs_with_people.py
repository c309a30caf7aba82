"""Whole runs that a person answers: they learn from every answer and lose none."""

from __future__ import annotations

import time
from collections import Counter
from concurrent.futures import Future
from typing import Any

import pytest
from sqlalchemy import select

from labels_db.models import Answer, Choice, Desired, Event, Query, RunState
from labels_db.records import fits_of
from labels_db.run_config import RunConfig
from labels_db.runs import get_run, resume_run, stop_run
from tests.trainer.conftest import RUN, Lab, small_config
from tests.trainer.people import LatePerson, Person, in_step
from tests.trainer.whole_runs import die_after_checkpoints, kill_and_go_on
from trainer.posting import PeoplesDesk
from trainer.rendering import Renderer
from trainer.replay import replay


def people_config(**settings: Any) -> RunConfig:
    people = {"feedback__teacher__kind": "human", "total_steps": 1000, "feedback__budget": 8}
    return small_config(**{**people, **settings})


@pytest.mark.parametrize(
    "settings",
    [
        {"feedback__pace": "block"},
        {"feedback__pace": "stream", "feedback__fit_every": 3, "feedback__patience_steps": 100},
        {"feedback__kind": "continuous", "feedback__fit_every": 4, "feedback__patience_steps": 100},
    ],
    ids=["block", "stream", "continuous"],
)
def test_a_run_with_a_person_learns_from_their_answers_and_repeats_exactly(
    lab: Lab, settings: dict[str, Any]
) -> None:
    lab.request(people_config(**settings))
    with Person(lab.database, RUN) as person:
        assert lab.live() is RunState.FINISHED
    with lab.database.read() as session:
        fits, posted = fits_of(session, RUN), session.scalars(select(Query)).all()
        assert all(query.first.clip is not None for query in posted)
    assert person.given >= 6
    assert fits[-1].cursor >= 6
    assert fits[-1].preferences > 0
    repeated = replay(lab.database, lab.store, RUN, lambda _steps: None)
    assert repeated.same, repeated.sentence()
    with lab.database.write() as session:  # and it is the answers that matter, not only the seed
        answer = session.scalars(select(Answer).order_by(Answer.sequence)).first()
        assert answer is not None
        answer.choice = Choice.FIRST if answer.choice is Choice.SECOND else Choice.SECOND
    assert not replay(lab.database, lab.store, RUN, lambda _steps: None).same


def test_a_run_with_a_person_goes_on_after_a_kill_without_losing_an_answer(lab: Lab) -> None:
    lab.request(people_config(feedback__pace="block"))
    with Person(lab.database, RUN) as person:
        kill_and_go_on(lab, die_after_checkpoints, 2)
    with lab.database.read() as session:
        queries = session.scalars(select(Query)).all()
        answers = session.scalars(select(Answer)).all()
        fits = fits_of(session, RUN)
    assert len(answers) == person.given == len(queries)
    assert len({(q.session_id, q.index) for q in queries}) == len(queries)
    assert fits[-1].cursor == len(answers)
    assert replay(lab.database, lab.store, RUN, lambda _steps: None).same


@pytest.mark.timeout(120)
def test_a_late_answer_leaves_no_query_that_training_waits_for(
    lab: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Session 1 asks 4; 3 are answered in time and 1 after session 2 asked for the 2 left: 1 is too many."""
    settings = {"feedback__budget": 5, "feedback__patience_steps": 200, "total_steps": 900}
    lab.request(people_config(feedback__pace="stream", **settings))
    person = LatePerson(lab.database, RUN, budget=5)
    in_step(person, monkeypatch)
    assert lab.live() is RunState.FINISHED
    assert person.was_late
    with lab.database.read() as session:
        reasons = Counter(query.closed_reason for query in session.scalars(select(Query)))
        assert fits_of(session, RUN)[-1].preferences == 5
    assert reasons == {"answered": 4, "superseded": 1, "unwanted": 1}


def test_stopped_while_clips_are_drawn_it_asks_the_rest_when_it_goes_on(
    lab: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    post = PeoplesDesk._post

    def slow_post(self: PeoplesDesk, *arguments: Any) -> None:
        post(self, *arguments)
        with lab.database.write() as session:
            if get_run(session, RUN).desired is not Desired.STOP and get_run(session, RUN).attempt == 1:
                stop_run(session, RUN)
        time.sleep(1)

    monkeypatch.setattr(PeoplesDesk, "_post", slow_post)
    lab.request(people_config(feedback__pace="block", feedback__budget=4))
    assert lab.live() is RunState.STOPPED
    with lab.database.write() as session:
        assert len(session.scalars(select(Query)).all()) < 4
        resume_run(session, RUN)
    with Person(lab.database, RUN) as person:
        assert lab.live() is RunState.FINISHED
    assert person.given == 4


def test_a_driver_that_hangs_costs_the_session_and_not_the_run(
    lab: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("trainer.posting.CLIP_SECONDS", 0.2)
    monkeypatch.setattr(Renderer, "clip", lambda *_: Future())
    lab.request(people_config(feedback__pace="block"))
    assert lab.live() is RunState.FINISHED
    with lab.database.read() as session:
        said = [event.text for event in session.scalars(select(Event))]
    assert any("Clips can no longer be rendered: nothing was drawn within" in text for text in said)
