"""Any runs beside each other: their curves in one chart, what differs between them, and which to add."""

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
from labels_db.run_names import runs_besides
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
    value: float | None
    without: str
    """The address of the page without it."""


@router.get("/compare")
def page(request: Request, services: ServicesDep, run: ChosenRuns, measure: str = RETURN) -> Response:
    """Those runs, in the order in which they are named; with fewer than two, only which to add."""
    run_ids = _chosen(run)
    with services.database.read() as session:
        seen = chosen_overviews(session, run_ids)
        last = last_evaluations(session, run_ids)
        others = runs_besides(session, run_ids)
    measures = measures_in(last.values())
    chosen, now = known_measure(measure, measures), utc_now()
    return render(
        request,
        "compare.html",
        address=_address(run_ids, chosen),
        chosen_runs=urlencode([("run", run_id) for run_id in run_ids]),
        evaluated_at=evaluated_at(last.values()),
        total_steps=max((each.config.total_steps for each in seen), default=0),
        measures=measures,
        measure=chosen,
        runs=_compared([view(each, now) for each in seen], last, chosen),
        differences=config_differences([each.config for each in seen]),
        others=others,
        most=MOST,
    )


def _chosen(run: Sequence[str]) -> list[str]:
    run_ids = [run_id for run_id in dict.fromkeys(run) if run_id]
    if len(run_ids) > MOST:
        raise ChoiceError(
            f"At most {MOST} runs can be compared, not {len(run_ids)}: go back and leave out {len(run_ids) - MOST}."
        )
    return run_ids


def _address(run_ids: Sequence[str], measure: str) -> str:
    return "/compare?" + urlencode([*(("run", run_id) for run_id in run_ids), ("measure", measure)])


def _compared(
    runs: Sequence[RunView], last: Mapping[str, EvaluationResult], measure: str
) -> list[ComparedRun]:
    return [
        ComparedRun(
            letter, shown, _value(last.get(shown.run.id), measure), _without(shown, runs, last, measure)
        )
        for letter, shown in zip(ascii_uppercase, runs, strict=False)
    ]


def _value(last: EvaluationResult | None, measure: str) -> float | None:
    return value_of(last, measure) if last else None


def _without(
    left: RunView, runs: Sequence[RunView], last: Mapping[str, EvaluationResult], measure: str
) -> str:
    """By the same measure, unless that run alone has it."""
    run_ids = [each.run.id for each in runs if each is not left]
    measures = measures_in(last[run_id] for run_id in run_ids if run_id in last)
    return _address(run_ids, measure if measure in measures else RETURN)
