"""A run's own page, and the buttons that steer it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

from fastapi import APIRouter, Form, Request
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse, Response

from labels_db.experiment_overview import experiment_title
from labels_db.goal_cards import change_goal
from labels_db.history import events_of, open_queries, recent_answers, sessions_of
from labels_db.log_tail import log_tail
from labels_db.models import Run, utc_now
from labels_db.overview import overview
from labels_db.policy_commands import ask_of_policy
from labels_db.records import evaluations_of, fits_of
from labels_db.runs import extend_run, pause_run, resume_run, stop_run
from server.answer_view import answer_view
from server.api_requests import LARGEST, GoalText, NewCommand, RunId
from server.forms import local_path
from server.policy_view import OPERATOR, policy_asks
from server.run_view import view
from server.sentences import queue_sentence
from server.services import Services, ServicesDep
from server.templating import render

router = APIRouter(prefix="/runs/{run_id}", include_in_schema=False)

ANSWERS_SHOWN = 6
EVENTS_SHOWN = 12
LOG_LINES = 60

Back = Annotated[str, Form()]
Goal = Annotated[GoalText, Form()]
Total = Annotated[int | None, Form(ge=1, le=LARGEST)]


class CommandForm(NewCommand):
    """A command as one of the page's buttons sends it, and where to come back to."""

    back: str = "/"


@router.get("")
def page(request: Request, run_id: RunId, services: ServicesDep, video: int | None = None) -> Response:
    """Everything about a run; `video` is the step of the policy to show, the latest when absent."""
    now = utc_now()
    with services.database.read() as session:
        seen = overview(session, run_id)
        videos = [found for found in evaluations_of(session, run_id) if found.video_key]
        context: dict[str, Any] = {
            "open_sentence": queue_sentence(open_queries(session, run_id, now=now, limit=1000)),
            "answers": [answer_view(each) for each in recent_answers(session, run_id, limit=ANSWERS_SHOWN)],
            "sessions": sessions_of(session, run_id),
            "fits": fits_of(session, run_id),
            "events": events_of(session, run_id, limit=EVENTS_SHOWN),
            "asks": policy_asks(session, seen.run),
            "experiment_title": seen.run.experiment and experiment_title(session, seen.run.experiment),
        }
    return render(
        request,
        "run.html",
        shown=view(seen, now),
        videos=videos,
        video=next((found for found in videos if found.step == video), videos[-1] if videos else None),
        log=log_tail(services.data.log_path(run_id), LOG_LINES),
        label_url=str(request.url.replace(path=f"/runs/{run_id}/label", query="")),
        **context,
    )


@router.post("/pause")
def pause(run_id: RunId, services: ServicesDep, back: Back = "/") -> Response:
    return _steer(services, run_id, pause_run, back)


@router.post("/resume")
def resume(run_id: RunId, services: ServicesDep, back: Back = "/") -> Response:
    return _steer(services, run_id, resume_run, back)


@router.post("/stop")
def stop(run_id: RunId, services: ServicesDep, back: Back = "/") -> Response:
    return _steer(services, run_id, stop_run, back)


@router.post("/extend")
def extend(
    run_id: RunId, services: ServicesDep, total_steps: Total = None, budget: Total = None, back: Back = "/"
) -> Response:
    with services.database.write() as session:
        extend_run(session, run_id, total_steps=total_steps, budget=budget)
    return _back(back)


@router.post("/goal")
def goal(run_id: RunId, services: ServicesDep, text: Goal, back: Back = "/") -> Response:
    with services.database.write() as session:
        change_goal(session, run_id, text)
    return _back(back)


@router.post("/commands")
def command(run_id: RunId, services: ServicesDep, asked: Annotated[CommandForm, Form()]) -> Response:
    with services.database.write() as session:
        ask_of_policy(session, run_id, asked.kind, asked_by=OPERATOR, **asked.arguments)
    return _back(asked.back)


def _steer(services: Services, run_id: str, use_case: Callable[[Session, str], Run], back: str) -> Response:
    with services.database.write() as session:
        use_case(session, run_id)
    return _back(back)


def _back(back: str) -> Response:
    return RedirectResponse(local_path(back), status_code=303)
