"""Use cases around what was chosen: from the side pressed to the answer kept, taken back, read in order."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime

from sqlalchemy import and_, func, or_, select, update
from sqlalchemy.orm import Session, joinedload

from labels_db.errors import ConflictError, NotFoundError
from labels_db.feedback_sessions import close_query, close_session_when_done, close_unwanted
from labels_db.leases import lend, own_lease
from labels_db.models import Answer, Choice, Lease, Pressed, Query, QueryState, Run
from labels_db.runs import get_run
from labels_db.standing import standing


def choices_by_key(*, swapped: bool) -> dict[Pressed, Choice]:
    """What each key means for the query's own order: the one place where sides become first and second."""
    left, right = (Choice.SECOND, Choice.FIRST) if swapped else (Choice.FIRST, Choice.SECOND)
    return {
        Pressed.LEFT: left,
        Pressed.RIGHT: right,
        Pressed.EQUAL: Choice.EQUAL,
        Pressed.SKIP: Choice.SKIP,
    }


def choice_of(pressed: Pressed, *, swapped: bool) -> Choice:
    """The pressed side in the query's own order."""
    return choices_by_key(swapped=swapped)[pressed]


def pressed_for(choice: Choice, *, swapped: bool) -> Pressed:
    """The key that says so: what scripted teachers press."""
    return next(key for key, meant in choices_by_key(swapped=swapped).items() if meant is choice)


def answer_query(
    session: Session,
    lease_id: int,
    labeller_id: int,
    *,
    answer_id: str,
    pressed: Pressed,
    now: datetime,
    shown_at: datetime | None = None,
    goal_card_version: int | None = None,
) -> Answer:
    """Record an answer under its client's id; the same id again returns the first result unchanged.

    An expired lease or a query closed meanwhile does not lose the answer: whatever was shown and judged counts.
    """
    lease = own_lease(session, lease_id, labeller_id)
    known = session.scalar(select(Answer).where(Answer.answer_id == answer_id))
    if known is not None:
        return _same_answer(known, lease)
    _expect_unanswered(session, lease)
    answer = Answer(
        run_id=lease.query.run_id,
        query=lease.query,
        labeller_id=labeller_id,
        sequence=_next_sequence(session, lease.query.run_id),
        answer_id=answer_id,
        lease=lease,
        choice=choice_of(pressed, swapped=lease.swapped),
        pressed=pressed,
        goal_card_version=goal_card_version or get_run(session, lease.query.run_id).goal.version,
        shown_at=shown_at,
        answered_at=now,
    )
    session.add(answer)
    session.flush()
    _close_when_answered(session, lease.query, now)
    return answer


def _same_answer(known: Answer, lease: Lease) -> Answer:
    if known.choice is None or (known.query_id, known.labeller_id) != (lease.query_id, lease.labeller_id):
        raise ConflictError(f"answer id {known.answer_id}: already used for something else; make a new one")
    return known


def _expect_unanswered(session: Session, lease: Lease) -> None:
    """One standing answer of each labeller to each query, and one answer through each lease."""
    earlier = select(Answer.id).where(
        or_(
            Answer.lease_id == lease.id,
            and_(Answer.query_id == lease.query_id, Answer.labeller_id == lease.labeller_id, standing()),
        )
    )
    if session.scalar(earlier.limit(1)) is not None:
        raise ConflictError(f"lease {lease.id}: already answered; ask for the next query")


def _close_when_answered(session: Session, query: Query, now: datetime) -> None:
    if query.state is not QueryState.OPEN:
        close_unwanted(session, get_run(session, query.run_id), now)
        return
    if _standing_answers(session, query) >= query.answers_needed:
        close_query(query, "answered", now)
        close_session_when_done(session, query.session_id, now)


def _standing_answers(session: Session, query: Query) -> int:
    return session.scalar(select(func.count()).where(Answer.query_id == query.id, standing())) or 0


def retract_answer(
    session: Session, target_id: str, labeller_id: int, *, answer_id: str, now: datetime
) -> tuple[Answer, Lease]:
    """Take an answer back; its query reopens, lent first to the same labeller on the same sides.

    The same retraction again changes nothing and returns the first result.
    """
    target = session.scalar(select(Answer).where(Answer.answer_id == target_id))
    if target is None or target.labeller_id != labeller_id or target.lease is None:
        raise NotFoundError(
            f"answer {target_id}: not one of yours, so it cannot be taken back", field="answer_id"
        )
    retraction = session.scalar(select(Answer).where(Answer.retracts == target.id))
    if retraction is None:
        _expect_unused(session, answer_id)
        retraction = Answer(
            run_id=target.run_id,
            query=target.query,
            labeller_id=labeller_id,
            sequence=_next_sequence(session, target.run_id),
            answer_id=answer_id,
            retracts=target.id,
            answered_at=now,
        )
        session.add(retraction)
        session.flush()
        _reopen_if_short(session, target.query)
        close_unwanted(session, get_run(session, target.run_id), now)
    elif retraction.answer_id != answer_id:
        raise ConflictError(f"answer {target_id}: already taken back")
    return retraction, _lease_after(session, target.lease, now)


def lease_of_answer(session: Session, answer_id: str) -> Lease | None:
    """The lease under which that answer was given."""
    return session.scalar(
        select(Lease).join(Answer, Answer.lease_id == Lease.id).where(Answer.answer_id == answer_id)
    )


def _expect_unused(session: Session, answer_id: str) -> None:
    if session.scalar(select(Answer.id).where(Answer.answer_id == answer_id)) is not None:
        raise ConflictError(f"retraction id {answer_id}: already used for something else; make a new one")


def _lease_after(session: Session, earlier: Lease, now: datetime) -> Lease:
    """The lease that a retraction gave for the one it took the answer of; made when there is none yet."""
    later = select(Lease).where(
        Lease.query_id == earlier.query_id, Lease.labeller_id == earlier.labeller_id, Lease.id > earlier.id
    )
    found = session.scalar(later.order_by(Lease.id).limit(1))
    if found is None:
        found = lend(session, earlier.query_id, earlier.labeller_id, now, swapped=earlier.swapped)
        session.flush()
    return found


def _reopen_if_short(session: Session, query: Query) -> None:
    """Not where others' answers are enough: it would be open and lent to nobody."""
    if query.state is QueryState.CLOSED and _standing_answers(session, query) < query.answers_needed:
        query.state, query.closed_reason, query.closed_at = QueryState.OPEN, None, None


def answers_since(session: Session, run_id: str, cursor: int, until: int | None = None) -> Sequence[Answer]:
    """The run's answers and retractions after `cursor` (and up to `until`), in sequence order."""
    wanted = select(Answer).where(Answer.run_id == run_id, Answer.sequence > cursor)
    if until is not None:
        wanted = wanted.where(Answer.sequence <= until)
    segments = joinedload(Query.first), joinedload(Query.second)
    shown = joinedload(Answer.query).options(*segments)
    return session.scalars(wanted.options(shown).order_by(Answer.sequence)).all()


def _next_sequence(session: Session, run_id: str) -> int:
    """The run's next answer number, taken in the answer's own transaction: commit order is number order."""
    taken = update(Run).where(Run.id == run_id).values(answer_sequence=Run.answer_sequence + 1)
    return session.execute(
        taken.returning(Run.answer_sequence).execution_options(synchronize_session=False)
    ).scalar_one()
