"""Any runs beside each other: their curves in one chart, and what differs between their configurations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from string import ascii_uppercase
from typing import Annotated
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from labels_db.config_differences import config_differences
from labels_db.errors import ChoiceError
from labels_db.evaluation_curves import RETURN, evaluated_at, last_evaluations, measures_in, value_of
from labels_db.models import EvaluationResult, utc_now
from labels_db.overview import chosen_overviews
from server.experiment_view import known_measure
from server.run_view import RunView, view
from server.services import ServicesDep
from server.templating import render

router = APIRouter(include_in_schema=False)

MOST = 12
"""So many lines can still be told apart, and so many columns read."""

ChosenRuns = Annotated[list[str], Query(default_factory=list)]


@dataclass(frozen=True)
class ComparedRun:
    """One of the runs, under the letter that the chart and the table call it by."""

    letter: str
    shown: RunView
    last: EvaluationResult | None
    value: float | None


@router.get("/compare")
def page(request: Request, services: ServicesDep, run: ChosenRuns, measure: str = RETURN) -> Response:
    """Those runs, in the order in which they are named."""
    run_ids = _chosen(run)
    with services.database.read() as session:
        seen = chosen_overviews(session, run_ids)
        last = last_evaluations(session, run_ids)
    measures = measures_in(last.values())
    chosen, now = known_measure(measure, measures), utc_now()
    return render(
        request,
        "compare.html",
        chosen_runs=urlencode([("run", run_id) for run_id in run_ids]),
        evaluated_at=evaluated_at(last.values()),
        total_steps=max(each.config.total_steps for each in seen),
        measures=measures,
        measure=chosen,
        runs=_compared([view(each, now) for each in seen], last, chosen),
        differences=config_differences([each.config for each in seen]),
    )


def _chosen(run: Sequence[str]) -> list[str]:
    run_ids = list(dict.fromkeys(run))
    if len(run_ids) < 2:
        raise ChoiceError("Choose at least two runs to compare.")
    if len(run_ids) > MOST:
        raise ChoiceError(f"Choose at most {MOST} runs to compare, not {len(run_ids)}.")
    return run_ids


def _compared(
    runs: Sequence[RunView], last: Mapping[str, EvaluationResult], measure: str
) -> list[ComparedRun]:
    found = (
        (letter, shown, last.get(shown.run.id)) for letter, shown in zip(ascii_uppercase, runs, strict=False)
    )
    return [
        ComparedRun(letter, shown, lived, value_of(lived, measure) if lived else None)
        for letter, shown, lived in found
    ]
