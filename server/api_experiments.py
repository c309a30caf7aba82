"""The API for experiments: how they stand, what their methods reached, and by what curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from fastapi import APIRouter

from labels_db.evaluation_curves import RETURN, Curve, curves_of, mean_curve
from labels_db.experiment_overview import (
    ExperimentOverview,
    ExperimentSummary,
    Result,
    experiment_overview,
    experiments,
)
from labels_db.overview import RunOverview
from server.api_experiment_replies import (
    ExperimentDetail,
    ExperimentOut,
    ExperimentRunOut,
    MeanCurve,
    ResultOut,
    TallyOut,
    TaskOut,
)
from server.api_refusals import REFUSED, UNKNOWN
from server.api_replies import Series
from server.api_requests import ExperimentName
from server.experiment_view import known_measure, task_title
from server.services import ServicesDep

router = APIRouter(prefix="/api/experiments", tags=["experiments"], responses=REFUSED)


@router.get("")
def list_experiments(services: ServicesDep) -> list[ExperimentOut]:
    """Every experiment that has runs, the newest first."""
    with services.database.read() as session:
        return [_experiment_out(summary) for summary in experiments(session)]


@router.get("/{name}", responses=UNKNOWN)
def show_experiment(name: ExperimentName, services: ServicesDep, measure: str = RETURN) -> ExperimentDetail:
    """One experiment as it is now, by one of the measures that its evaluations have."""
    with services.database.read() as session:
        shown = experiment_overview(session, name)
        chosen = known_measure(measure, shown.measures)
        curves = curves_of(session, [seen.run.id for seen in shown.runs], chosen)
    return ExperimentDetail(
        **_experiment_out(shown.summary).model_dump(),
        measures=shown.measures,
        measure=chosen,
        results=[_result_out(shown, result, curves) for result in shown.results(chosen)],
        runs=[_run_out(seen, curves) for seen in shown.runs],
    )


def _experiment_out(summary: ExperimentSummary) -> ExperimentOut:
    return ExperimentOut(
        name=summary.name,
        title=summary.title,
        created_at=summary.created_at,
        tasks=[TaskOut(name=task, title=task_title(task)) for task in summary.tasks],
        methods=list(summary.methods),
        tally=TallyOut.model_validate(summary.tally),
    )


def _result_out(shown: ExperimentOverview, result: Result, curves: Mapping[str, Curve]) -> ResultOut:
    runs = [seen.run.id for seen in shown.counted(result.task, result.method)]
    return ResultOut(
        task=result.task,
        method=result.method,
        tally=TallyOut.model_validate(result.tally),
        evaluated=result.last.count if result.last else 0,
        mean=result.last.mean if result.last else None,
        deviation=result.last.deviation if result.last else None,
        answers=result.answers,
        curve=_mean_curve([curves[run_id] for run_id in runs if run_id in curves]),
    )


def _mean_curve(curves: Sequence[Curve]) -> MeanCurve:
    points = mean_curve(curves)
    return MeanCurve(
        steps=[step for step, _ in points],
        means=[spread.mean for _, spread in points],
        deviations=[spread.deviation for _, spread in points],
    )


def _run_out(seen: RunOverview, curves: Mapping[str, Curve]) -> ExperimentRunOut:
    curve = curves.get(seen.run.id, [])
    return ExperimentRunOut(
        id=seen.run.id,
        task=seen.run.preset or "",
        method=seen.run.method or "",
        seed=seen.config.seed,
        state=seen.run.state,
        step=seen.run.step,
        total_steps=seen.config.total_steps,
        answers=seen.feedback.given,
        curve=Series(steps=[step for step, _ in curve], values=[value for _, value in curve]),
    )
