"""How far a run's feedback has come: what has been asked, answered, and still waits."""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import ColumnElement, func, select
from sqlalchemy.orm import Session

from labels_db.models import Answer, Choice, Desired, FeedbackSession, Query, QueryState, Run
from labels_db.runs import config_of, get_run
from labels_db.standing import standing


@dataclass(frozen=True)
class FeedbackProgress:
    """Counts of one run. `given` is what the budget counts; `rendering` is asked but not yet posted."""

    budget: int
    given: int
    preferences: int
    skipped: int
    open: int
    posted: int
    rendering: int

    @property
    def remaining(self) -> int:
        return max(0, self.budget - self.given)


def feedback_progress(session: Session, run: Run) -> FeedbackProgress:
    """Count the run's queries and standing answers.

    People: a query counts once somebody has preferred or called it equal. Scripted: every query posted counts.
    """
    config = config_of(run)
    judged = (Answer.run_id == run.id, standing())
    preferences = _count(
        session, func.count(Answer.query_id.distinct()), *judged, Answer.choice != Choice.SKIP
    )
    posted = _count(session, func.count(Query.id), Query.run_id == run.id)
    return FeedbackProgress(
        budget=config.budget,
        given=preferences if config.asks_people else posted,
        preferences=preferences,
        skipped=_count(session, func.count(Answer.id), *judged, Answer.choice == Choice.SKIP),
        open=_open(session, run.id),
        posted=posted,
        rendering=_rendering(session, run.id),
    )


def _open(session: Session, run_id: str) -> int:
    return _count(session, func.count(Query.id), Query.run_id == run_id, Query.state == QueryState.OPEN)


def _rendering(session: Session, run_id: str) -> int:
    asked = select(func.coalesce(func.sum(FeedbackSession.asked), 0)).where(
        FeedbackSession.run_id == run_id, FeedbackSession.closed_at.is_(None)
    )
    posted = (
        select(func.count(Query.id))
        .join(FeedbackSession, FeedbackSession.id == Query.session_id)
        .where(FeedbackSession.run_id == run_id, FeedbackSession.closed_at.is_(None))
    )
    return max(0, (session.scalar(asked) or 0) - (session.scalar(posted) or 0))


def _count(session: Session, what: ColumnElement[int], *conditions: ColumnElement[bool]) -> int:
    return session.scalar(select(what).where(*conditions)) or 0


@dataclass(frozen=True)
class Inbox:
    """What a trainer looks at between steps: what is wanted of it, and whether answers have come."""

    desired: Desired
    sequence: int
    open: int
    rendering: int

    @property
    def complete(self) -> bool:
        """Whether everything asked has been posted and answered."""
        return self.open == 0 and self.rendering == 0


def read_inbox(session: Session, run_id: str) -> Inbox:
    run = get_run(session, run_id)
    return Inbox(run.desired, run.answer_sequence, _open(session, run_id), _rendering(session, run_id))
