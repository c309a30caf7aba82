"""A feedback session opens, is adopted by the next attempt, fills, and closes."""

from __future__ import annotations

import pytest
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from labels_db import claims, feedback_sessions, runs
from labels_db.claims import Claim
from labels_db.database import Database
from labels_db.feedback_progress import feedback_progress, read_inbox
from labels_db.models import FeedbackSession, Pressed, QueryState
from tests.labels_db import given
from tests.labels_db.given import NOW


def _answer_all(session: Session, *, pressed: Pressed = Pressed.LEFT) -> None:
    ann = given.labeller(session)
    for lease in given.leases(session, ann, 99):
        given.an_answer(session, lease, f"{lease.id}-{pressed}", pressed=pressed)


def test_the_next_attempt_adopts_a_session_with_its_queries(database: Database) -> None:
    with database.write() as session:
        first = given.a_claim(session)
        asked = given.queries(session, first, 3)
        claims.interrupt_run(session, runs.get_run(session, "mill"), "gone")
        second = claims.claim_run(session, "next", max_parallel=1, now=NOW)
        assert second == Claim("mill", 2)
        adopted = feedback_sessions.open_session(session, second, index=0, step=9999, asked=7)
        assert (adopted.step, adopted.asked) == (1000, 3)
        assert feedback_sessions.session_queries(session, adopted.id) == asked


def test_a_place_in_a_session_is_posted_once(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        given.queries(session, owner, 1)
    with pytest.raises(IntegrityError), database.write() as session:
        given.queries(session, owner, 1)


def test_a_session_closes_with_its_last_query(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        query, lost = given.queries(session, owner, 2)
        opened = session.get_one(FeedbackSession, query.session_id)
        feedback_sessions.fail_query(session, lost, "clip lost")
        assert opened.closed_at is None
        _answer_all(session)
        assert (query.state, query.closed_reason, lost.state) == ("closed", "answered", "failed")
        assert opened.closed_at == NOW


def test_a_session_closes_when_its_only_open_query_is_lost(database: Database) -> None:
    with database.write() as session:
        (query,) = given.queries(session, given.a_claim(session), 1)
        feedback_sessions.fail_query(session, query, "clip lost")
        assert session.get_one(FeedbackSession, query.session_id).closed_at is not None


def test_fresh_queries_supersede_those_of_earlier_sessions(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        old = given.queries(session, owner, 2)
        feedback_sessions.open_session(session, owner, index=1, step=2000, asked=2)
        assert feedback_sessions.supersede_queries(session, owner, before=1) == 2
        assert {(q.state, q.closed_reason) for q in old} == {(QueryState.CLOSED, "superseded")}
        assert given.leases(session, given.labeller(session)) == []


def test_what_was_asked_but_not_posted_is_rendering(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        opened = feedback_sessions.open_session(session, owner, index=0, step=0, asked=3)
        assert read_inbox(session, "mill").rendering == 3
        given.queries(session, owner, 1)
        inbox = read_inbox(session, "mill")
        assert (inbox.open, inbox.rendering, inbox.complete) == (1, 2, False)
        feedback_sessions.trim_session(session, owner, opened.id)
        assert read_inbox(session, "mill").rendering == 0
        _answer_all(session)
        assert read_inbox(session, "mill").complete
        assert opened.closed_at == NOW


def test_trimming_a_session_that_is_answered_closes_it(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        opened = feedback_sessions.open_session(session, owner, index=0, step=0, asked=3)
        given.queries(session, owner, 1)
        _answer_all(session)
        assert opened.closed_at is None
        feedback_sessions.trim_session(session, owner, opened.id)
        assert opened.closed_at is not None


def test_progress_counts_what_the_budget_counts(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        given.queries(session, owner, 3)
        ann = given.labeller(session)
        for lease, pressed in zip(given.leases(session, ann, 3), ("left", "equal", "skip"), strict=True):
            given.an_answer(session, lease, str(lease.id), pressed=Pressed(pressed))
        progress = feedback_progress(session, runs.get_run(session, "mill"))
        assert (progress.budget, progress.given, progress.remaining) == (50, 2, 48)
        assert (progress.preferences, progress.skipped, progress.open, progress.posted) == (2, 1, 0, 3)


def test_two_people_on_one_query_count_once(database: Database) -> None:
    with database.write() as session:
        given.queries(session, given.a_claim(session), 1, answers_needed=2)
        for name in ("ann", "bob"):
            (lease,) = given.leases(session, given.labeller(session, name))
            given.an_answer(session, lease, name)
        assert feedback_progress(session, runs.get_run(session, "mill")).given == 1


def test_scripted_teachers_spend_their_budget_by_asking(database: Database) -> None:
    with database.write() as session:
        run = runs.request_run(session, given.SCRIPTED, title="", goal="", run_id="mill")
        given.queries(session, claims.claim(session, run, "s", now=NOW), 4)
        assert feedback_progress(session, run).given == 4


def test_what_the_budget_no_longer_wants_is_closed(database: Database) -> None:
    """Session 2 of 2 asks what is left; meanwhile the superseded pair still on screen is answered too."""
    with database.write() as session:
        owner = given.a_claim(session, budget=3)
        given.queries(session, owner, 2)
        ann = given.labeller(session)
        for number, lease in enumerate(given.leases(session, ann, 2)):
            if number == 0:
                given.an_answer(session, lease, "in time")
        feedback_sessions.supersede_queries(session, owner, before=1)
        oldest, newest = given.queries(session, owner, 2, session_index=1)
        given.an_answer(session, lease, "late")
        assert (oldest.state, newest.state, newest.closed_reason) == ("open", "closed", "unwanted")
        _answer_all(session)
        assert read_inbox(session, "mill").complete
        assert session.get_one(FeedbackSession, newest.session_id).closed_at == NOW


def test_a_second_opinion_stays_wanted(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session, budget=2)
        given.queries(session, owner, 1)
        (late,) = given.leases(session, given.labeller(session))
        feedback_sessions.supersede_queries(session, owner, before=1)
        twice, never = given.queries(session, owner, 2, answers_needed=2, session_index=1)
        (lease,) = given.leases(session, given.labeller(session, "bob"))
        given.an_answer(session, lease, "first opinion")
        given.an_answer(session, late, "late")
        assert (twice.state, never.state) == ("open", "closed")
