"""An experiment's own page: what its methods reached on its tasks, how, and its runs."""

from __future__ import annotations

from fastapi import APIRouter, Request
from starlette.responses import Response

from labels_db.evaluation_curves import RETURN
from labels_db.experiment_overview import experiment_overview
from labels_db.models import utc_now
from server.api_requests import ExperimentName
from server.experiment_view import experiment_view, known_measure, runs_of, tasks_of
from server.services import ServicesDep
from server.templating import render

router = APIRouter(include_in_schema=False)


@router.get("/experiments/{name}")
def page(request: Request, name: ExperimentName, services: ServicesDep, measure: str = RETURN) -> Response:
    """Everything about an experiment, by one of the measures that its evaluations have."""
    with services.database.read() as session:
        shown = experiment_overview(session, name)
    chosen = known_measure(measure, shown.measures)
    return render(
        request,
        "experiment.html",
        experiment=experiment_view(shown.summary),
        evaluated_at=shown.evaluated_at,
        measures=shown.measures,
        measure=chosen,
        tasks=tasks_of(shown, chosen),
        runs=runs_of(shown, chosen, utc_now()),
    )
