"""A run as a whole, in one look: what the dashboard's rows and a run's header say."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import Select, select
from sqlalchemy.orm import Session, selectinload

from labels_db.claims import queue_positions
from labels_db.evaluation_curves import RETURN, Curve, curves_of
from labels_db.feedback_progress import FeedbackProgress, feedback_progress_of
from labels_db.models import GoalCard, Run
from labels_db.run_config import RunConfig
from labels_db.runs import config_of, get_run


@dataclass(frozen=True)
class RunOverview:
    """A run with its configuration, its present goal, its feedback and the returns it has reached."""

    run: Run
    config: RunConfig
    goal: GoalCard
    feedback: FeedbackProgress
    queue_position: int | None
    returns: Curve
    """Step and mean true return of every evaluation, in step order; none for runs seen as an experiment's."""

    @property
    def last_return(self) -> float | None:
        """What the latest evaluation came to."""
        return self.returns[-1][1] if self.returns else None


def overview(session: Session, run_id: str) -> RunOverview:
    """One run."""
    return chosen_overviews(session, [run_id])[0]


def chosen_overviews(session: Session, run_ids: Sequence[str]) -> list[RunOverview]:
    """Those runs, in that order; NotFoundError names the first that there is not."""
    return _overviews(session, [get_run(session, run_id) for run_id in run_ids])


def overviews(session: Session) -> list[RunOverview]:
    """Every run that is not archived, the newest first."""
    return _overviews(session, _found(session, _kept().order_by(Run.created_at.desc(), Run.id)))


def single_overviews(session: Session) -> list[RunOverview]:
    """Those that belong to no experiment, the newest first."""
    single = _kept().where(Run.experiment.is_(None))
    return _overviews(session, _found(session, single.order_by(Run.created_at.desc(), Run.id)))


def experiment_overviews(session: Session, name: str) -> list[RunOverview]:
    """Those of an experiment, in the order in which they were asked for.

    Without their returns: that can be tens of thousands, and whoever wants them asks for one measure's curves.
    """
    own = _kept().where(Run.experiment == name)
    return _overviews(session, _found(session, own.order_by(Run.created_at, Run.id)), with_returns=False)


def _kept() -> Select[Run]:
    return select(Run).where(~Run.archived)


def _found(session: Session, wanted: Select[Run]) -> Sequence[Run]:
    return session.scalars(wanted.options(selectinload(Run.goal_cards))).all()


def _overviews(session: Session, runs: Sequence[Run], *, with_returns: bool = True) -> list[RunOverview]:
    positions, feedback = queue_positions(session), feedback_progress_of(session, runs)
    returns = curves_of(session, [run.id for run in runs], RETURN) if with_returns else {}
    return [
        RunOverview(
            run=run,
            config=config_of(run),
            goal=run.goal,
            feedback=feedback[run.id],
            queue_position=positions.get(run.id),
            returns=returns.get(run.id, []),
        )
        for run in runs
    ]
