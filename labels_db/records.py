"""What is recorded of training: metrics, fits, scores, evaluations, checkpoints."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Select, delete, insert, select
from sqlalchemy.dialects.sqlite import insert as upsert
from sqlalchemy.orm import Session

from labels_db.claims import Claim, made_progress, owned_run
from labels_db.feedback_sessions import forget_unposted
from labels_db.models import Checkpoint, EvaluationResult, Fit, Metric, QueryScore, utc_now


@dataclass(frozen=True)
class Measurement:
    """One number of a run at one step."""

    step: int
    name: str
    value: float


def record_metrics(session: Session, claim: Claim, measurements: Iterable[Measurement]) -> None:
    """Keep the numbers; one measured again at the same step replaces the earlier.

    What is no number (the return of an environment gone astray) is left out: SQLite has no NaN; a curve shows the gap.
    """
    owned_run(session, claim)
    rows = [
        {"run_id": claim.run_id, "name": m.name, "step": m.step, "value": m.value}
        for m in measurements
        if math.isfinite(m.value)
    ]
    if rows:
        statement = upsert(Metric)
        session.execute(
            statement.on_conflict_do_update(
                index_elements=["run_id", "name", "step"], set_={"value": statement.excluded.value}
            ),
            rows,
        )


def metrics_since(session: Session, run_id: str, step: int, names: Sequence[str]) -> Sequence[Metric]:
    """The named metrics after a step, in step order; all of them where none is named."""
    found = select(Metric).where(Metric.run_id == run_id, Metric.step > step).order_by(Metric.step)
    return session.scalars(found.where(Metric.name.in_(names)) if names else found).all()


@dataclass(frozen=True)
class FitReport:
    """How one fit went: accuracies are shares of preferences, absent where all were equal."""

    preferences: int
    epochs: int
    training_accuracy: float | None
    fresh_accuracy: float | None


def record_fit(
    session: Session,
    claim: Claim,
    *,
    index: int,
    step: int,
    cursor: int,
    report: FitReport,
    probabilities: Mapping[int, float],
) -> Fit:
    """Keep a fit and the P[second ≻ first] it gives each query (by query id)."""
    owned_run(session, claim)
    fit = Fit(
        run_id=claim.run_id,
        index=index,
        step=step,
        cursor=cursor,
        preferences=report.preferences,
        epochs=report.epochs,
        training_accuracy=report.training_accuracy,
        fresh_accuracy=report.fresh_accuracy,
        at=utc_now(),
    )
    session.add(fit)
    session.flush()
    rows = [{"fit_id": fit.id, "query_id": query, "probability": p} for query, p in probabilities.items()]
    if rows:
        session.execute(insert(QueryScore), rows)
    return fit


def fits_of(session: Session, run_id: str) -> Sequence[Fit]:
    """The run's fits in order."""
    return session.scalars(select(Fit).where(Fit.run_id == run_id).order_by(Fit.index)).all()


def record_evaluation(
    session: Session,
    claim: Claim,
    *,
    step: int,
    returns: Sequence[float],
    measures: Mapping[str, Any],
    video_key: str | None,
) -> EvaluationResult:
    """Keep an evaluation; one made again at the same step replaces the earlier, but for its video."""
    owned_run(session, claim)
    found = evaluation(claim.run_id, step=step, returns=returns, measures=measures)
    found.video_key = video_key
    if (before := evaluation_at(session, claim.run_id, step)) is not None:
        found.video_key = video_key or before.video_key
        session.delete(before)
        session.flush()
    session.add(found)
    session.flush()
    return found


def evaluation(
    run_id: str, *, step: int, returns: Sequence[float], measures: Mapping[str, Any]
) -> EvaluationResult:
    """The row of episodes that have just been lived through."""
    return EvaluationResult(
        run_id=run_id,
        step=step,
        returns=list(returns),
        mean_return=sum(returns) / len(returns),
        measures=dict(measures),
        at=utc_now(),
    )


def attach_video(session: Session, claim: Claim, *, step: int, video_key: str) -> None:
    """The evaluation's episode has been rendered."""
    owned_run(session, claim)
    found = evaluation_at(session, claim.run_id, step)
    if found is not None:
        found.video_key = video_key


def evaluation_at(session: Session, run_id: str, step: int) -> EvaluationResult | None:
    """The run's evaluation at that very step."""
    return session.scalar(_evaluations(run_id).where(EvaluationResult.step == step))


def evaluations_of(session: Session, run_id: str) -> Sequence[EvaluationResult]:
    """The run's evaluations in step order."""
    return session.scalars(_evaluations(run_id)).all()


def _evaluations(run_id: str) -> Select[EvaluationResult]:
    return select(EvaluationResult).where(EvaluationResult.run_id == run_id).order_by(EvaluationResult.step)


def record_checkpoint(
    session: Session, claim: Claim, *, step: int, manifest_key: str, checksum: str
) -> Checkpoint:
    """Keep a written checkpoint, which counts as progress unless the attempt comes just where an earlier one died."""
    owned_run(session, claim)
    last = next(iter(checkpoints_of(session, claim.run_id)), None)
    if last is None or step > last.step or last.attempt == claim.attempt:
        made_progress(session, claim)
    checkpoint = Checkpoint(
        run_id=claim.run_id,
        attempt=claim.attempt,
        step=step,
        manifest_key=manifest_key,
        checksum=checksum,
        at=utc_now(),
    )
    session.add(checkpoint)
    session.flush()
    return checkpoint


def checkpoints_of(session: Session, run_id: str) -> Sequence[Checkpoint]:
    """The run's checkpoints, latest first."""
    return session.scalars(
        select(Checkpoint).where(Checkpoint.run_id == run_id).order_by(Checkpoint.id.desc())
    ).all()


def forget_checkpoints(session: Session, claim: Claim, checkpoint_ids: Sequence[int]) -> None:
    """Drop checkpoints whose files are about to be deleted."""
    owned_run(session, claim)
    session.execute(delete(Checkpoint).where(Checkpoint.id.in_(checkpoint_ids)))


def rewind(session: Session, claim: Claim, *, step: int, fits: int) -> None:
    """Forget what an attempt recorded after the checkpoint that the run now goes on from.

    Answers and queries stay: those belong to the run. What is forgotten here is computed again.
    """
    owned_run(session, claim)
    run_id = claim.run_id
    session.execute(delete(Fit).where(Fit.run_id == run_id, Fit.index >= fits))
    session.execute(delete(Metric).where(Metric.run_id == run_id, Metric.step > step))
    session.execute(
        delete(EvaluationResult).where(EvaluationResult.run_id == run_id, EvaluationResult.step > step)
    )
    forget_unposted(session, claim, after=step)
