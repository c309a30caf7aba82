"""What has happened to a run: events, sessions, queries and answers as people read them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import ColumnElement, exists, func, select
from sqlalchemy.orm import Session, aliased, joinedload

from labels_db.models import (
    Answer,
    Event,
    FeedbackSession,
    Fit,
    Lease,
    Query,
    QueryScore,
    QueryState,
    Segment,
)
from labels_db.standing import standing


def events_of(session: Session, run_id: str, *, limit: int) -> Sequence[Event]:
    """The run's latest events, the newest first."""
    wanted = select(Event).where(Event.run_id == run_id).order_by(Event.id.desc())
    return session.scalars(wanted.limit(limit)).all()


@dataclass(frozen=True)
class AnswerRecord:
    """One answer: `probability` is P[second ≻ first] under the latest fit that scored its query."""

    answer: Answer
    taken_back: bool
    probability: float | None


def recent_answers(session: Session, run_id: str, *, limit: int) -> list[AnswerRecord]:
    """The run's latest answers, the newest first; retractions show as answers taken back."""
    retraction = aliased(Answer)
    wanted = (
        select(Answer, exists().where(retraction.retracts == Answer.id), _latest_probability())
        .where(Answer.run_id == run_id, Answer.choice.is_not(None))
        .options(
            joinedload(Answer.labeller),
            joinedload(Answer.query).joinedload(Query.first).joinedload(Segment.clip),
            joinedload(Answer.query).joinedload(Query.second).joinedload(Segment.clip),
        )
        .order_by(Answer.sequence.desc())
        .limit(limit)
    )
    return [AnswerRecord(*row) for row in session.execute(wanted)]


def _latest_probability() -> ColumnElement[float | None]:
    return (
        select(QueryScore.probability)
        .join(Fit, Fit.id == QueryScore.fit_id)
        .where(QueryScore.query_id == Answer.query_id)
        .order_by(Fit.index.desc())
        .limit(1)
        .correlate(Answer)
        .scalar_subquery()
    )


@dataclass(frozen=True)
class SessionRecord:
    """A feedback session and how many of its queries were posted, and answered or closed."""

    session: FeedbackSession
    posted: int
    closed: int


def sessions_of(session: Session, run_id: str) -> list[SessionRecord]:
    """The run's feedback sessions in order."""
    closed = func.count(Query.id).filter(Query.state != QueryState.OPEN)
    wanted = (
        select(FeedbackSession, func.count(Query.id), closed)
        .outerjoin(Query, Query.session_id == FeedbackSession.id)
        .where(FeedbackSession.run_id == run_id)
        .group_by(FeedbackSession.id)
        .order_by(FeedbackSession.index)
    )
    return [SessionRecord(*row) for row in session.execute(wanted)]


@dataclass(frozen=True)
class OpenQuery:
    """A query that still waits: `leased` counts the labellers who are looking at it now."""

    query: Query
    given: int
    leased: int


def open_queries(session: Session, run_id: str, *, now: datetime, limit: int) -> list[OpenQuery]:
    """The run's open queries, in the order they will be lent."""
    wanted = (
        select(Query, _given(), _leased(now))
        .where(Query.run_id == run_id, Query.state == QueryState.OPEN)
        .order_by(Query.session_id, Query.index)
        .limit(limit)
    )
    return [OpenQuery(*row) for row in session.execute(wanted)]


def recent_queries(session: Session, run_id: str, *, limit: int) -> Sequence[Query]:
    """The run's latest queries, the newest first."""
    wanted = select(Query).where(Query.run_id == run_id).order_by(Query.id.desc())
    return session.scalars(wanted.limit(limit)).all()


def _given() -> ColumnElement[int]:
    given = select(func.count()).where(Answer.query_id == Query.id, standing())
    return given.correlate(Query).scalar_subquery()


def _leased(now: datetime) -> ColumnElement[int]:
    lent = select(func.count()).where(Lease.query_id == Query.id, Lease.expires_at > now)
    return lent.where(~exists().where(Answer.lease_id == Lease.id)).correlate(Query).scalar_subquery()
