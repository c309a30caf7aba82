"""The API for what a run has recorded: metrics, evaluations, fits, queries, answers, events, log."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from typing import Annotated

from fastapi import APIRouter, Query

from labels_db.history import events_of, recent_answers, recent_queries
from labels_db.log_tail import log_tail
from labels_db.models import Metric
from labels_db.records import evaluations_of, fits_of, metrics_since
from labels_db.runs import get_run
from server.api_refusals import REFUSED, UNKNOWN
from server.api_replies import (
    AnswerOut,
    EvaluationOut,
    EventOut,
    FitOut,
    LogOut,
    MetricsOut,
    QueryOut,
    Series,
)
from server.api_requests import LARGEST, RunId
from server.replies import answer_out, evaluation_out
from server.services import ServicesDep

Limit = Annotated[int, Query(ge=1, le=1000, description="At most so many, the newest first.")]
Names = Annotated[
    str, Query(description="Metrics, comma-separated; all when empty.", examples=["episode_return"])
]
Since = Annotated[int, Query(ge=-1, le=LARGEST, description="Only what was measured after this step.")]

router = APIRouter(prefix="/api/runs/{run_id}", tags=["records"], responses=REFUSED | UNKNOWN)


@router.get("/metrics")
def metrics(run_id: RunId, services: ServicesDep, since: Since = -1, names: Names = "") -> MetricsOut:
    """The run's curves after a step; ask again with `since` for what has come meanwhile."""
    wanted = [name.strip() for name in names.split(",") if name.strip()]
    with services.database.read() as session:
        run = get_run(session, run_id)
        found = metrics_since(session, run_id, since, wanted)
    return MetricsOut(attempt=run.attempt, step=run.step, series=_series(found))


def _series(found: Iterable[Metric]) -> dict[str, Series]:
    series: dict[str, Series] = defaultdict(lambda: Series(steps=[], values=[]))
    for metric in found:
        series[metric.name].steps.append(metric.step)
        series[metric.name].values.append(metric.value)
    return series


@router.get("/evaluations")
def evaluations(run_id: RunId, services: ServicesDep) -> list[EvaluationOut]:
    """How the policy did, in step order, with the address of each video."""
    with services.database.read() as session:
        get_run(session, run_id)
        return [evaluation_out(found) for found in evaluations_of(session, run_id)]


@router.get("/fits")
def fits(run_id: RunId, services: ServicesDep) -> list[FitOut]:
    """The reward model's fits, in order."""
    with services.database.read() as session:
        get_run(session, run_id)
        return [FitOut.model_validate(found) for found in fits_of(session, run_id)]


@router.get("/queries")
def queries(run_id: RunId, services: ServicesDep, limit: Limit = 100) -> list[QueryOut]:
    """The latest queries."""
    with services.database.read() as session:
        get_run(session, run_id)
        return [QueryOut.model_validate(found) for found in recent_queries(session, run_id, limit=limit)]


@router.get("/answers")
def answers(run_id: RunId, services: ServicesDep, limit: Limit = 100) -> list[AnswerOut]:
    """The latest answers."""
    with services.database.read() as session:
        get_run(session, run_id)
        return [answer_out(record) for record in recent_answers(session, run_id, limit=limit)]


@router.get("/events")
def events(run_id: RunId, services: ServicesDep, limit: Limit = 100) -> list[EventOut]:
    """What has happened to the run."""
    with services.database.read() as session:
        get_run(session, run_id)
        return [EventOut.model_validate(event) for event in events_of(session, run_id, limit=limit)]


@router.get("/log")
def log(run_id: RunId, services: ServicesDep, lines: Limit = 200) -> LogOut:
    """The end of the run's log."""
    with services.database.read() as session:
        get_run(session, run_id)
    return LogOut(lines=log_tail(services.data.log_path(run_id), lines))
