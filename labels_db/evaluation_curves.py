"""What evaluations measured, for several runs at once: last values, curves, and means over seeds."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from statistics import fmean, pstdev

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from labels_db.models import EvaluationResult

RETURN = "return"
"""The measure that every evaluation has; the others are the environment's own."""

Curve = Sequence[tuple[int, float]]
"""Step and value of one run's evaluations, in step order."""


@dataclass(frozen=True)
class Spread:
    """Mean and standard deviation (the population's, as figures draw it) of so many runs."""

    mean: float
    deviation: float
    count: int


def spread_of(values: Sequence[float]) -> Spread | None:
    """None where there is no value."""
    return Spread(fmean(values), pstdev(values), len(values)) if values else None


def last_evaluations(session: Session, run_ids: Collection[str]) -> dict[str, EvaluationResult]:
    """The latest evaluation of every run that has one."""
    last = (
        select(EvaluationResult.run_id, func.max(EvaluationResult.step).label("step"))
        .where(EvaluationResult.run_id.in_(run_ids))
        .group_by(EvaluationResult.run_id)
        .subquery()
    )
    same = (EvaluationResult.run_id == last.c.run_id) & (EvaluationResult.step == last.c.step)
    return {found.run_id: found for found in session.scalars(select(EvaluationResult).join(last, same))}


def evaluated_at(last: Iterable[EvaluationResult]) -> str:
    """Changes with every evaluation: whoever draws curves need not ask for them before it does."""
    return max((found.at.isoformat() for found in last), default="")


def measures_in(evaluations: Iterable[EvaluationResult]) -> list[str]:
    """The return, then whatever else was measured as a number."""
    measured = (pair for found in evaluations for pair in found.measures.items())
    return [RETURN, *dict.fromkeys(name for name, value in measured if _number(value) is not None)]


def value_of(found: EvaluationResult, measure: str) -> float | None:
    """What it measured; None where it did not, or found no number."""
    return _number(found.mean_return if measure == RETURN else found.measures.get(measure))


def curves_of(session: Session, run_ids: Collection[str], measure: str) -> dict[str, Curve]:
    """One measure of every evaluation of those runs; a run that it was never measured of is left out."""
    # Returns have a column of their own, which spares reading thousands of JSON values.
    column = EvaluationResult.mean_return if measure == RETURN else EvaluationResult.measures
    wanted = select(EvaluationResult.run_id, EvaluationResult.step, column)
    found: dict[str, list[tuple[int, float]]] = defaultdict(list)
    for run_id, step, kept in session.execute(
        wanted.where(EvaluationResult.run_id.in_(run_ids)).order_by(EvaluationResult.step)
    ):
        value = _number(kept.get(measure) if isinstance(kept, dict) else kept)
        if value is not None:
            found[run_id].append((step, value))
    return dict(found)


def mean_curve(curves: Sequence[Curve]) -> list[tuple[int, Spread]]:
    """The curves' mean and deviation at the steps that all of them share."""
    by_step: dict[int, list[float]] = defaultdict(list)
    for curve in curves:
        for step, value in curve:
            by_step[step].append(value)
    shared = sorted(step for step, values in by_step.items() if len(values) == len(curves))
    return [(step, spread) for step in shared if (spread := spread_of(by_step[step]))]


def _number(value: object) -> float | None:
    """The value if it can be drawn: no truth value, no text, nothing infinite."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return float(value)
