"""How far a run's feedback has come: what has been asked, answered, and still waits."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from sqlalchemy import ColumnElement, Select, func, select
from sqlalchemy.orm import InstrumentedAttribute, Session

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
    """One run's counts."""
    return feedback_progress_of(session, [run])[run.id]


def feedback_progress_of(session: Session, runs: Sequence[Run]) -> dict[str, FeedbackProgress]:
    """Count each run's queries and standing answers, with as many statements for many runs as for one.

    People: a query counts once somebody has preferred or called it equal. Scripted: every query posted counts.
    """
    ids = [run.id for run in runs]
    judged = _each(Answer.run_id, func.count(Answer.query_id.distinct()), ids).where(standing())
    preferences = _counts(session, judged.where(Answer.choice != Choice.SKIP))
    skips = _each(Answer.run_id, func.count(Answer.id), ids).where(standing(), Answer.choice == Choice.SKIP)
    skipped = _counts(session, skips)
    posted = _counts(session, _each(Query.run_id, func.count(Query.id), ids))
    waiting, rendering = _open(session, ids), _rendering(session, ids)
    found = {}
    for run in runs:
        config = config_of(run)
        found[run.id] = FeedbackProgress(
            budget=config.budget,
            given=preferences[run.id] if config.asks_people else posted[run.id],
            preferences=preferences[run.id],
            skipped=skipped[run.id],
            open=waiting[run.id],
            posted=posted[run.id],
            rendering=rendering[run.id],
        )
    return found


def _open(session: Session, ids: Collection[str]) -> Counter[str]:
    return _counts(
        session, _each(Query.run_id, func.count(Query.id), ids).where(Query.state == QueryState.OPEN)
    )


def _rendering(session: Session, ids: Collection[str]) -> Counter[str]:
    """Asked by sessions that are still open, less what those have posted."""
    going = FeedbackSession.closed_at.is_(None)
    asked = _each(FeedbackSession.run_id, func.sum(FeedbackSession.asked), ids).where(going)
    posted = _each(FeedbackSession.run_id, func.count(Query.id), ids).where(going)
    return _counts(session, asked) - _counts(
        session, posted.join(Query, FeedbackSession.id == Query.session_id)
    )


Counted = Select[str, int]


def _each(run_id: InstrumentedAttribute[str], what: ColumnElement[int], ids: Collection[str]) -> Counted:
    return select(run_id, what).where(run_id.in_(ids)).group_by(run_id)


def _counts(session: Session, wanted: Counted) -> Counter[str]:
    """By run; a run that nothing was found of has 0."""
    return Counter(dict(session.execute(wanted).all()))


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
    waiting, rendering = _open(session, [run_id]), _rendering(session, [run_id])
    return Inbox(run.desired, run.answer_sequence, waiting[run_id], rendering[run_id])
