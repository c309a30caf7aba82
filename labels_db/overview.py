"""A run as a whole, in one look: what the dashboard's rows and a run's header say."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session, selectinload

from labels_db.feedback_progress import FeedbackProgress, feedback_progress
from labels_db.models import EvaluationResult, GoalCard, Run
from labels_db.run_config import RunConfig
from labels_db.runs import config_of, get_run, queue_positions


@dataclass(frozen=True)
class RunOverview:
    """A run with its configuration, its present goal, its feedback and the returns it has reached."""

    run: Run
    config: RunConfig
    goal: GoalCard
    feedback: FeedbackProgress
    queue_position: int | None
    returns: Sequence[tuple[int, float]]
    """Step and mean true return of every evaluation, in step order."""


def overview(session: Session, run_id: str) -> RunOverview:
    """One run."""
    return _overviews(session, [get_run(session, run_id)])[0]


def overviews(session: Session) -> list[RunOverview]:
    """Every run that is not archived, the newest first."""
    wanted = select(Run).where(~Run.archived).order_by(Run.created_at.desc(), Run.id)
    return _overviews(session, session.scalars(wanted.options(selectinload(Run.goal_cards))).all())


def _overviews(session: Session, runs: Sequence[Run]) -> list[RunOverview]:
    positions, returns = queue_positions(session), _returns(session, [run.id for run in runs])
    return [
        RunOverview(
            run=run,
            config=config_of(run),
            goal=run.goal_cards[-1],
            feedback=feedback_progress(session, run),
            queue_position=positions.get(run.id),
            returns=returns[run.id],
        )
        for run in runs
    ]


def _returns(session: Session, run_ids: Sequence[str]) -> dict[str, list[tuple[int, float]]]:
    found: dict[str, list[tuple[int, float]]] = defaultdict(list)
    wanted = select(EvaluationResult.run_id, EvaluationResult.step, EvaluationResult.mean_return)
    for run_id, step, mean in session.execute(
        wanted.where(EvaluationResult.run_id.in_(run_ids)).order_by(EvaluationResult.step)
    ):
        found[run_id].append((step, mean))
    return found
