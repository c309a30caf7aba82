"""Use cases around a query's life: a session opens, queries are posted, lent, answered, retracted, closed."""

from __future__ import annotations

import functools
import random
from collections.abc import Sequence
from datetime import datetime, timedelta

from sqlalchemy import ColumnElement, Select, and_, exists, func, or_, select, update
from sqlalchemy.orm import Session, aliased, joinedload

from labels_db.errors import ConflictError, NotFoundError
from labels_db.models import (
    Answer,
    Choice,
    FeedbackSession,
    GoalCard,
    Labeller,
    LabellerKind,
    Lease,
    Pressed,
    Query,
    QueryState,
    Run,
    Segment,
    utc_now,
)
from labels_db.runs import Claim, get_run, owned_run

LEASE_TIME = timedelta(seconds=60)


# Sessions and queries ----------------------------------------------------------------------------


def open_session(session: Session, claim: Claim, *, index: int, step: int, asked: int) -> FeedbackSession:
    """Session `index` of the run; one that an earlier attempt opened is adopted with its queries."""
    owned_run(session, claim)
    found = find_session(session, claim.run_id, index)
    if found is None:
        found = FeedbackSession(run_id=claim.run_id, index=index, step=step, asked=asked, opened_at=utc_now())
        session.add(found)
        session.flush()
    return found


def session_queries(session: Session, session_id: int) -> Sequence[Query]:
    """The queries posted in a session, by index."""
    return session.scalars(select(Query).where(Query.session_id == session_id).order_by(Query.index)).all()


def post_query(
    session: Session,
    claim: Claim,
    feedback_session: FeedbackSession,
    *,
    index: int,
    segments: tuple[Segment, Segment],
    scheme: str,
    score: float | None,
    answers_needed: int = 1,
) -> Query:
    """Ask one pair. Its artifacts must be in the store before: a row appears when what it points at exists."""
    owned_run(session, claim)
    query = Query(
        run_id=claim.run_id,
        session_id=feedback_session.id,
        index=index,
        first=segments[0],
        second=segments[1],
        scheme=scheme,
        score=score,
        answers_needed=answers_needed,
        posted_at=utc_now(),
    )
    session.add(query)
    session.flush()
    return query


def find_session(session: Session, run_id: str, index: int) -> FeedbackSession | None:
    """Session `index` of the run, if any attempt has opened it."""
    return session.scalar(
        select(FeedbackSession).where(FeedbackSession.run_id == run_id, FeedbackSession.index == index)
    )


def supersede_queries(session: Session, claim: Claim, *, before: int | None = None) -> int:
    """Close the open queries of all sessions, or of those before an index; returns how many.

    Fresher ones take their place, or the run has finished and no answer could teach it anything.
    """
    owned_run(session, claim)
    now = utc_now()
    earlier = select(FeedbackSession.id).where(FeedbackSession.run_id == claim.run_id)
    if before is not None:
        earlier = earlier.where(FeedbackSession.index < before)
    still_open = session.scalars(
        select(Query).where(Query.session_id.in_(earlier), Query.state == QueryState.OPEN)
    ).all()
    for query in still_open:
        _close(query, "superseded", now)
    session.execute(
        update(FeedbackSession)
        .where(FeedbackSession.id.in_(earlier), FeedbackSession.closed_at.is_(None))
        .values(closed_at=now)
    )
    return len(still_open)


def trim_session(session: Session, claim: Claim, session_id: int) -> None:
    """Ask no more in this session than has been posted: the rest can no longer be rendered."""
    owned_run(session, claim)
    found = session.get_one(FeedbackSession, session_id)
    found.asked = len(session_queries(session, session_id))
    _close_session_when_done(session, session_id, utc_now())


def fail_query(session: Session, query: Query, reason: str) -> None:
    """The query's clip is lost: nobody can answer it any more."""
    query.state = QueryState.FAILED
    query.closed_reason = reason
    query.closed_at = utc_now()
    _close_session_when_done(session, query.session_id, query.closed_at)


def _close(query: Query, reason: str, now: datetime) -> None:
    query.state, query.closed_reason, query.closed_at = QueryState.CLOSED, reason, now


# Labellers and leases ----------------------------------------------------------------------------


def labeller_named(session: Session, name: str, kind: LabellerKind = LabellerKind.PERSON) -> Labeller:
    """The labeller of that name, made when new."""
    found = session.scalar(select(Labeller).where(Labeller.name == name, Labeller.kind == kind))
    if found is None:
        found = Labeller(name=name, kind=kind, created_at=utc_now())
        session.add(found)
        session.flush()
    return found


def lease_queries(
    session: Session, run_id: str, labeller_id: int, *, count: int, now: datetime, rng: random.Random
) -> list[Lease]:
    """Up to `count` leases of that labeller, oldest query first: the ones held, renewed, and fresh ones.

    A query is available while standing answers and others' leases are fewer than needed, and the labeller
    has neither. Sides are swapped at random once; a lease that lapsed or was given back comes back to its
    labeller with the same sides, so that a reloaded page shows the same pair.
    """
    run = get_run(session, run_id)
    if run.archived:
        raise ConflictError(f"run {run_id}: archived, so its queries can no longer be answered")
    held = list(session.scalars(held_leases(run_id, labeller_id, now).limit(count)))
    for lease in held:
        lease.expires_at = now + LEASE_TIME
    fresh = session.scalars(available_queries(run_id, labeller_id, now).limit(count - len(held))).all()
    leases = held + [_lend_again_or_anew(session, query.id, labeller_id, now, rng) for query in fresh]
    session.flush()
    return leases


def release_lease(session: Session, lease_id: int, labeller_id: int, *, now: datetime) -> None:
    """Give a query back unanswered."""
    lease = own_lease(session, lease_id, labeller_id)
    lease.expires_at = min(lease.expires_at, now)


def own_lease(session: Session, lease_id: int, labeller_id: int) -> Lease:
    """The labeller's lease of that number; NotFoundError for anybody else's."""
    lease = session.get(Lease, lease_id)
    if lease is None or lease.labeller_id != labeller_id:
        raise NotFoundError(f"lease {lease_id}: not yours; ask for a new one")
    return lease


def _lend_again_or_anew(
    session: Session, query_id: int, labeller_id: int, now: datetime, rng: random.Random
) -> Lease:
    earlier = session.scalar(
        select(Lease)
        .where(
            Lease.query_id == query_id,
            Lease.labeller_id == labeller_id,
            unanswered(),
        )
        .order_by(Lease.id.desc())
        .limit(1)
    )
    if earlier is None:
        return lend(session, query_id, labeller_id, now, swapped=rng.random() < 0.5)
    earlier.expires_at = now + LEASE_TIME
    return earlier


def lend(session: Session, query_id: int, labeller_id: int, now: datetime, *, swapped: bool) -> Lease:
    """A fresh lease; `lease_queries` sees to who may have one."""
    lease = Lease(
        query_id=query_id,
        labeller_id=labeller_id,
        swapped=swapped,
        granted_at=now,
        expires_at=now + LEASE_TIME,
    )
    session.add(lease)
    return lease


def held_leases(run_id: str, labeller_id: int, now: datetime) -> Select[Lease]:
    """The labeller's valid, unanswered leases of the run, oldest query first."""
    return (
        select(Lease)
        .join(Lease.query)
        .where(
            Query.run_id == run_id,
            Query.state == QueryState.OPEN,
            Lease.labeller_id == labeller_id,
            Lease.expires_at > now,
            unanswered(),
        )
        .order_by(Query.session_id, Query.index)
    )


@functools.cache  # building it anew costs more than running it
def unanswered() -> ColumnElement[bool]:
    """Condition on `Lease`: no answer was ever given through it."""
    return ~exists().where(Answer.lease_id == Lease.id)


@functools.cache  # building it anew costs more than running it
def standing() -> ColumnElement[bool]:
    """Condition on `Answer`: a choice that no retraction has taken back."""
    retraction = aliased(Answer)
    return Answer.choice.is_not(None) & ~exists().where(retraction.retracts == Answer.id)


def available_queries(run_id: str, labeller_id: int, now: datetime) -> Select[Query]:
    """The run's queries that the labeller could lease besides the ones held, oldest first."""
    answered = (Answer.query_id == Query.id, standing())
    lent = (Lease.query_id == Query.id, Lease.expires_at > now, unanswered())
    answers = select(func.count(Answer.id)).where(*answered).scalar_subquery()
    leases = select(func.count(Lease.id)).where(*lent).scalar_subquery()
    return (
        select(Query)
        .where(
            Query.run_id == run_id,
            Query.state == QueryState.OPEN,
            answers + leases < Query.answers_needed,
            ~exists().where(*answered, Answer.labeller_id == labeller_id),
            ~exists().where(*lent, Lease.labeller_id == labeller_id),
        )
        .order_by(Query.session_id, Query.index)
    )


# Answers -----------------------------------------------------------------------------------------


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
        goal_card_version=goal_card_version or _goal_version(session, lease.query.run_id),
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


def retract_answer(
    session: Session, target_id: str, labeller_id: int, *, answer_id: str, now: datetime
) -> tuple[Answer, Lease]:
    """Take an answer back; its query reopens, lent first to the same labeller on the same sides.

    The same retraction again changes nothing and returns the first result.
    """
    target = session.scalar(select(Answer).where(Answer.answer_id == target_id))
    if target is None or target.labeller_id != labeller_id or target.lease is None:
        raise NotFoundError(f"answer {target_id}: not one of yours, so it cannot be taken back")
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
        _reopen(target.query)
    elif retraction.answer_id != answer_id:
        raise ConflictError(f"answer {target_id}: already taken back")
    return retraction, _lease_after(session, target.lease, now)


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


def _reopen(query: Query) -> None:
    if query.state is QueryState.CLOSED:
        query.state, query.closed_reason, query.closed_at = QueryState.OPEN, None, None


def _close_when_answered(session: Session, query: Query, now: datetime) -> None:
    given = session.scalar(select(func.count()).where(Answer.query_id == query.id, standing())) or 0
    if query.state is QueryState.OPEN and given >= query.answers_needed:
        _close(query, "answered", now)
        _close_session_when_done(session, query.session_id, now)


def _close_session_when_done(session: Session, session_id: int, now: datetime) -> None:
    found = session.get_one(FeedbackSession, session_id)
    ended = select(func.count(Query.id)).where(Query.session_id == session_id, Query.state != QueryState.OPEN)
    if session.scalar(ended) == found.asked:
        found.closed_at = found.closed_at or now


def _next_sequence(session: Session, run_id: str) -> int:
    """The run's next answer number, taken in the answer's own transaction: commit order is number order."""
    taken = update(Run).where(Run.id == run_id).values(answer_sequence=Run.answer_sequence + 1)
    return session.execute(
        taken.returning(Run.answer_sequence).execution_options(synchronize_session=False)
    ).scalar_one()


def _goal_version(session: Session, run_id: str) -> int | None:
    return session.scalar(select(func.max(GoalCard.version)).where(GoalCard.run_id == run_id))


def answers_since(session: Session, run_id: str, cursor: int, until: int | None = None) -> Sequence[Answer]:
    """The run's answers and retractions after `cursor` (and up to `until`), in sequence order."""
    wanted = select(Answer).where(Answer.run_id == run_id, Answer.sequence > cursor)
    if until is not None:
        wanted = wanted.where(Answer.sequence <= until)
    return session.scalars(wanted.options(joinedload(Answer.query)).order_by(Answer.sequence)).all()
