"""Use cases around what is asked: a feedback session opens, its queries are posted and close, and so does it."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime

from sqlalchemy import exists, func, or_, select, update
from sqlalchemy.orm import Session

from labels_db.claims import Claim, owned_run
from labels_db.feedback_progress import feedback_progress
from labels_db.models import Answer, FeedbackSession, Query, QueryState, Run, Segment, utc_now
from labels_db.standing import standing


def open_session(
    session: Session,
    claim: Claim,
    *,
    index: int,
    step: int,
    asked: int,
    segment_return: float | None = None,
) -> FeedbackSession:
    """Session `index` of the run; one that an earlier attempt opened is adopted with its queries."""
    owned_run(session, claim)
    found = find_session(session, claim.run_id, index)
    if found is None:
        found = FeedbackSession(
            run_id=claim.run_id,
            index=index,
            step=step,
            asked=asked,
            opened_at=utc_now(),
            segment_return=segment_return,
        )
        session.add(found)
        session.flush()
    return found


def find_session(session: Session, run_id: str, index: int) -> FeedbackSession | None:
    """Session `index` of the run, if any attempt has opened it."""
    return session.scalar(
        select(FeedbackSession).where(FeedbackSession.run_id == run_id, FeedbackSession.index == index)
    )


def session_queries(session: Session, session_id: int) -> Sequence[Query]:
    """The queries posted in a session, by index."""
    return session.scalars(select(Query).where(Query.session_id == session_id).order_by(Query.index)).all()


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
        close_query(query, "superseded", now)
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
    close_session_when_done(session, session_id, utc_now())


def forget_unposted(session: Session, claim: Claim, *, after: int) -> None:
    """Sessions opened after that step ask no more than they have posted, and those without a query never were.

    Training goes on from before them: it would wait for the rest, which nobody is to post until it comes there again.
    """
    later = select(FeedbackSession).where(
        FeedbackSession.run_id == claim.run_id, FeedbackSession.step > after
    )
    for opened in session.scalars(later).all():
        if session_queries(session, opened.id):
            trim_session(session, claim, opened.id)
        else:
            session.delete(opened)


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


def fail_query(session: Session, query: Query, reason: str) -> None:
    """The query's clip is lost: nobody can answer it any more."""
    query.state = QueryState.FAILED
    query.closed_reason = reason
    query.closed_at = utc_now()
    close_session_when_done(session, query.session_id, query.closed_at)


def fail_queries_showing(session: Session, segment_id: int, reason: str) -> None:
    """The segment's clip is lost: fail every open query that shows it."""
    shows = or_(Query.first_id == segment_id, Query.second_id == segment_id)
    for query in session.scalars(select(Query).where(shows, Query.state == QueryState.OPEN)).all():
        fail_query(session, query, reason)


def close_query(query: Query, reason: str, now: datetime) -> None:
    """Nobody is to answer it any more; its session is closed by `close_session_when_done`."""
    query.state, query.closed_reason, query.closed_at = QueryState.CLOSED, reason, now


def close_unwanted(session: Session, run: Run, now: datetime) -> None:
    """Close the newest open queries that nobody has judged, as far as the budget no longer wants them.

    Answers to superseded queries count, so a session may ask more than turns out to be left; without this
    training would wait for answers that nobody is to give.
    """
    counted = feedback_progress(session, run)
    judged = exists().where(Answer.query_id == Query.id, standing())
    unjudged = select(Query).where(Query.run_id == run.id, Query.state == QueryState.OPEN, ~judged)
    wanted = max(0, counted.budget - counted.preferences)
    newest_last = unjudged.order_by(Query.session_id, Query.index)
    for query in session.scalars(newest_last.offset(wanted)).all():
        close_query(query, "unwanted", now)
        close_session_when_done(session, query.session_id, now)


def close_session_when_done(session: Session, session_id: int, now: datetime) -> None:
    """Close the session once as many queries as it asked have ended."""
    found = session.get_one(FeedbackSession, session_id)
    ended = select(func.count(Query.id)).where(Query.session_id == session_id, Query.state != QueryState.OPEN)
    if session.scalar(ended) == found.asked:
        found.closed_at = found.closed_at or now
