"""From the side pressed to the answer kept, delivered once or often, and taken back."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import given as examples
from hypothesis import strategies as st
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from labels_db import answers, feedback_sessions, leases
from labels_db.database import Database
from labels_db.errors import ConflictError, NotFoundError
from labels_db.leases import LEASE_TIME
from labels_db.models import Answer, Choice, Lease, Pressed
from labels_db.standing import standing
from tests.labels_db import given
from tests.labels_db.given import NOW, SECOND

SWAPPED = st.booleans()
PRESSED = st.sampled_from(Pressed)


def _shown(lease: Lease) -> dict[Pressed, int]:
    """What a page shows: the segment on each side."""
    first, second = lease.query.first_id, lease.query.second_id
    left, right = (second, first) if lease.swapped else (first, second)
    return {Pressed.LEFT: left, Pressed.RIGHT: right}


def _chosen(answer: Answer) -> int | None:
    """The segment that the kept answer prefers."""
    query = answer.query
    return {Choice.FIRST: query.first_id, Choice.SECOND: query.second_id}.get(answer.choice or Choice.SKIP)


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@examples(swapped=SWAPPED, pressed=PRESSED)
def test_the_segment_that_was_pressed_is_the_one_preferred(
    database: Database, swapped: bool, pressed: Pressed
) -> None:
    with database.write() as session:
        (lease,) = _fresh_lease(session)
        lease.swapped = swapped
        answer = given.an_answer(session, lease, pressed=pressed)
        assert _chosen(answer) == _shown(lease).get(pressed)
        assert (answer.choice == Choice.EQUAL) == (pressed is Pressed.EQUAL)
        assert (answer.choice == Choice.SKIP) == (pressed is Pressed.SKIP)
        assert answer.pressed is pressed
        session.rollback()


@examples(pressed=PRESSED)
def test_swapping_sides_swaps_first_and_second_only(pressed: Pressed) -> None:
    plain, swapped = (answers.choice_of(pressed, swapped=value) for value in (False, True))
    mirrored = {Choice.FIRST: Choice.SECOND, Choice.SECOND: Choice.FIRST}
    assert swapped == mirrored.get(plain, plain)


@examples(pressed=PRESSED, swapped=SWAPPED)
def test_each_choice_has_the_key_that_gives_it(pressed: Pressed, swapped: bool) -> None:
    choice = answers.choice_of(pressed, swapped=swapped)
    assert answers.pressed_for(choice, swapped=swapped) is pressed


def _fresh_lease(session: Session) -> list[Lease]:
    given.queries(session, given.a_claim(session), 1)
    return given.leases(session, given.labeller(session))


def test_an_answer_keeps_what_was_shown_and_when(database: Database) -> None:
    with database.write() as session:
        (lease,) = _fresh_lease(session)
        answer = answers.answer_query(
            session,
            lease.id,
            lease.labeller_id,
            answer_id="a",
            pressed=Pressed.SKIP,
            now=NOW + SECOND,
            shown_at=NOW,
        )
    with database.read() as session:
        kept = session.get_one(Answer, answer.id)
        assert (kept.run_id, kept.sequence, kept.goal_card_version) == ("mill", 1, 1)
        assert (kept.shown_at, kept.answered_at, kept.lease_id) == (NOW, NOW + SECOND, lease.id)


def test_the_same_answer_delivered_twice_changes_nothing(database: Database) -> None:
    with database.write() as session:
        (lease,) = _fresh_lease(session)
        first = given.an_answer(session, lease, pressed=Pressed.LEFT)
        before = (first.choice, first.sequence, first.answered_at)
    with database.write() as session:
        again = answers.answer_query(
            session,
            lease.id,
            lease.labeller_id,
            answer_id="a-1",
            pressed=Pressed.RIGHT,
            now=NOW + SECOND,
        )
        assert (again.choice, again.sequence, again.answered_at) == before
        assert session.scalar(select(func.count(Answer.id))) == 1


def test_an_answer_id_is_never_taken_for_another_query(database: Database) -> None:
    with database.write() as session:
        given.queries(session, given.a_claim(session), 2)
        one, two = given.leases(session, given.labeller(session), 2)
        given.an_answer(session, one, "same")
        with pytest.raises(ConflictError, match="answer id same: already used"):
            given.an_answer(session, two, "same")


def test_an_answer_id_is_never_taken_for_somebody_elses(database: Database) -> None:
    with database.write() as session:
        given.queries(session, given.a_claim(session), 1, answers_needed=2)
        (ann,) = given.leases(session, given.labeller(session, "ann"))
        (bob,) = given.leases(session, given.labeller(session, "bob"))
        given.an_answer(session, ann, "same")
        with pytest.raises(ConflictError, match="answer id same: already used"):
            given.an_answer(session, bob, "same")


def test_a_query_is_answered_once_by_each_labeller(database: Database) -> None:
    with database.write() as session:
        (lease,) = _fresh_lease(session)
        given.an_answer(session, lease, "a")
        with pytest.raises(ConflictError, match="already answered"):
            given.an_answer(session, lease, "b")
        stray = leases.lend(session, lease.query_id, lease.labeller_id, NOW, swapped=True)
        session.flush()
        with pytest.raises(ConflictError, match="already answered"):
            given.an_answer(session, stray, "c")


def test_an_answer_through_an_expired_lease_counts(database: Database) -> None:
    with database.write() as session:
        (lease,) = _fresh_lease(session)
        answer = given.an_answer(session, lease, at=NOW + 10 * LEASE_TIME)
        assert answer.query.state == "closed"


def test_an_answer_to_a_superseded_query_counts(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        (query,) = given.queries(session, owner, 1)
        (lease,) = given.leases(session, given.labeller(session))
        feedback_sessions.supersede_queries(session, owner, before=1)
        assert given.an_answer(session, lease).choice is not None
        assert query.closed_reason == "superseded"


def test_an_answer_through_the_lease_of_another_is_refused(database: Database) -> None:
    with database.write() as session:
        (lease,) = _fresh_lease(session)
        bob = given.labeller(session, "bob")
        with pytest.raises(NotFoundError, match="not yours"):
            answers.answer_query(session, lease.id, bob, answer_id="a", pressed=Pressed.LEFT, now=NOW)


# Retractions -------------------------------------------------------------------------------------


def _retract(session: Session, lease: Lease, answer_id: str = "r-1") -> tuple[Answer, Lease]:
    return answers.retract_answer(session, "a-1", lease.labeller_id, answer_id=answer_id, now=NOW)


@pytest.mark.parametrize("swapped", [False, True])
def test_a_retraction_gives_the_query_back_on_the_same_sides(database: Database, swapped: bool) -> None:
    with database.write() as session:
        (lease,) = _fresh_lease(session)
        lease.swapped = swapped
        answer = given.an_answer(session, lease)
        retraction, again = _retract(session, lease)
        assert (retraction.retracts, retraction.choice, retraction.sequence) == (answer.id, None, 2)
        assert (again.query_id, again.swapped, again.id != lease.id) == (lease.query_id, swapped, True)
        assert lease.query.state == "open"
        assert given.leases(session, given.labeller(session, "bob")) == []
        assert given.leases(session, lease.labeller_id) == [again]


def test_a_query_taken_back_can_be_answered_anew(database: Database) -> None:
    with database.write() as session:
        (lease,) = _fresh_lease(session)
        given.an_answer(session, lease)
        _retraction, again = _retract(session, lease)
        second = given.an_answer(session, again, "a-2", pressed=Pressed.RIGHT)
        assert second.query.state == "closed"
        kept = session.scalars(select(Answer.answer_id).where(standing())).all()
        assert kept == ["a-2"]


def test_a_query_taken_back_and_left_goes_to_another(database: Database) -> None:
    with database.write() as session:
        (lease,) = _fresh_lease(session)
        given.an_answer(session, lease)
        _retract(session, lease)
        bob = given.labeller(session, "bob")
        assert len(given.leases(session, bob, at=NOW + LEASE_TIME + SECOND)) == 1


def test_the_same_retraction_delivered_twice_changes_nothing(database: Database) -> None:
    with database.write() as session:
        (lease,) = _fresh_lease(session)
        given.an_answer(session, lease)
        first = _retract(session, lease)
        given.an_answer(session, first[1], "a-2")
        assert _retract(session, lease) == first
        assert first[0].query.state == "closed"
        assert session.scalar(select(func.count(Lease.id))) == 2


def test_an_answer_is_taken_back_once(database: Database) -> None:
    with database.write() as session:
        (lease,) = _fresh_lease(session)
        given.an_answer(session, lease)
        _retract(session, lease)
        with pytest.raises(ConflictError, match="already taken back"):
            _retract(session, lease, "r-2")


def test_a_retraction_needs_an_id_of_its_own(database: Database) -> None:
    with database.write() as session:
        (lease,) = _fresh_lease(session)
        given.an_answer(session, lease)
        with pytest.raises(ConflictError, match="already used"):
            _retract(session, lease, "a-1")


@pytest.mark.parametrize("target", ["nothing", "r-1"])
def test_only_ones_own_answers_are_taken_back(database: Database, target: str) -> None:
    with database.write() as session:
        (lease,) = _fresh_lease(session)
        given.an_answer(session, lease)
        _retract(session, lease)
        with pytest.raises(NotFoundError, match=f"answer {target}: not one of yours"):
            answers.retract_answer(session, target, lease.labeller_id, answer_id="x", now=NOW)
        bob = given.labeller(session, "bob")
        with pytest.raises(NotFoundError, match="answer a-1: not one of yours"):
            answers.retract_answer(session, "a-1", bob, answer_id="x", now=NOW)


# The cursor --------------------------------------------------------------------------------------


def test_a_cursor_reads_answers_and_retractions_in_order(database: Database) -> None:
    with database.write() as session:
        (lease,) = _fresh_lease(session)
        given.an_answer(session, lease)
        _retraction, again = _retract(session, lease)
        given.an_answer(session, again, "a-2")
    with database.read() as session:
        read = [answer.answer_id for answer in answers.answers_since(session, "mill", 0)]
        assert read == ["a-1", "r-1", "a-2"]
        assert [answer.sequence for answer in answers.answers_since(session, "mill", 1)] == [2, 3]
        assert [answer.sequence for answer in answers.answers_since(session, "mill", 1, until=2)] == [2]


def test_each_run_counts_for_itself(database: Database) -> None:
    with database.write() as session:
        ann = given.labeller(session)
        for run_id in ("one", "two"):
            given.queries(session, given.a_claim(session, run_id), 1)
            (lease,) = given.leases(session, ann, run_id=run_id)
            assert given.an_answer(session, lease, run_id).sequence == 1


def test_a_transaction_that_fails_leaves_no_gap(database: Database) -> None:
    with database.write() as session:
        given.queries(session, given.a_claim(session), 2)
        one, two = given.leases(session, given.labeller(session), 2)
    with database.write() as session:
        given.an_answer(session, one, "lost")
        session.rollback()
    with database.write() as session:
        assert given.an_answer(session, two, "kept").sequence == 1


def test_undo_does_not_reopen_what_another_has_answered(database: Database) -> None:
    """Ann's lease lapses, Bob answers, Ann's answer arrives late and is taken back: Bob's is enough."""
    with database.write() as session:
        (query,) = given.queries(session, given.a_claim(session), 1)
        (late,) = given.leases(session, given.labeller(session, "ann"))
        later = NOW + LEASE_TIME + SECOND
        (lease,) = given.leases(session, given.labeller(session, "bob"), at=later)
        given.an_answer(session, lease, "bob's", at=later)
        given.an_answer(session, late, "ann's", at=later)
        answers.retract_answer(session, "ann's", late.labeller_id, answer_id="undo", now=later)
        assert query.state == "closed"


def test_undoing_a_skip_closes_what_was_asked_in_its_place(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session, budget=1)
        (skipped,) = given.queries(session, owner, 1)
        (lease,) = given.leases(session, given.labeller(session))
        given.an_answer(session, lease, "skip", pressed=Pressed.SKIP)
        (instead,) = given.queries(session, owner, 1, session_index=1)
        answers.retract_answer(session, "skip", lease.labeller_id, answer_id="undo", now=NOW)
        assert (skipped.state, instead.state) == ("open", "closed")
