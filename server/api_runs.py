"""The API for starting and steering runs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fastapi import APIRouter, Response
from sqlalchemy.orm import Session

from labels_db.goal_cards import change_goal
from labels_db.models import Run, utc_now
from labels_db.overview import overview, overviews
from labels_db.presets import presets
from labels_db.runs import extend_run, get_run, pause_run, resume_run, stop_run
from server.api_refusals import NOT_NOW, REFUSED, UNKNOWN
from server.api_replies import GoalOut, PresetDetail, PresetOut, RunOut
from server.api_requests import Extension, NewGoal, NewRun, RunId
from server.new_run import chosen_config, chosen_preset, queue_run
from server.replies import preset_detail, preset_out, run_out
from server.services import Services, ServicesDep

router = APIRouter(prefix="/api", responses=REFUSED)


@router.get("/presets", tags=["presets"])
def list_presets() -> list[PresetOut]:
    """Every preset, in the order they are shown."""
    return [preset_out(preset) for preset in presets().values()]


@router.get("/presets/{name}", tags=["presets"])
def show_preset(name: str, profile: str | None = None) -> PresetDetail:
    """A preset with all its settings: their values, bounds and what they mean."""
    preset = chosen_preset(name)
    chosen_config(preset, profile, {})
    return preset_detail(preset, profile or next(iter(preset.profiles)))


@router.post("/runs", tags=["runs"], status_code=201)
def create_run(asked: NewRun, services: ServicesDep, response: Response) -> RunOut:
    """Queue a run; it starts by itself when its turn comes."""
    preset = chosen_preset(asked.preset)
    config = chosen_config(preset, asked.profile, asked.settings)
    with services.database.write() as session:
        run_id = queue_run(session, preset, config, title=asked.title, goal=asked.goal).id
    response.headers["Location"] = f"/api/runs/{run_id}"
    return _show(services, run_id)


@router.get("/runs", tags=["runs"])
def list_runs(services: ServicesDep) -> list[RunOut]:
    """Every run, the newest first."""
    now = utc_now()
    with services.database.read() as session:
        return [run_out(seen, now) for seen in overviews(session)]


@router.get("/runs/{run_id}", tags=["runs"], responses=UNKNOWN)
def show_run(run_id: RunId, services: ServicesDep) -> RunOut:
    """One run as it is now."""
    return _show(services, run_id)


@router.get("/runs/{run_id}/config", tags=["runs"], responses=UNKNOWN)
def show_config(run_id: RunId, services: ServicesDep, response: Response) -> dict[str, Any]:
    """The run's whole configuration, to keep or to start another from."""
    with services.database.read() as session:
        run = get_run(session, run_id)
    response.headers["Content-Disposition"] = f'attachment; filename="{run.id}.json"'
    return run.config


@router.post("/runs/{run_id}/pause", tags=["runs"], responses=UNKNOWN | NOT_NOW)
def pause(run_id: RunId, services: ServicesDep) -> RunOut:
    """Stand still at the next step; answers still count."""
    return _steer(services, run_id, pause_run)


@router.post("/runs/{run_id}/resume", tags=["runs"], responses=UNKNOWN | NOT_NOW)
def resume(run_id: RunId, services: ServicesDep) -> RunOut:
    """Go on: at once when paused, from the last checkpoint when stopped or failed."""
    return _steer(services, run_id, resume_run)


@router.post("/runs/{run_id}/stop", tags=["runs"], responses=UNKNOWN | NOT_NOW)
def stop(run_id: RunId, services: ServicesDep) -> RunOut:
    """Stop at the next step, with a checkpoint to resume from."""
    return _steer(services, run_id, stop_run)


@router.post("/runs/{run_id}/extend", tags=["runs"], responses=UNKNOWN | NOT_NOW)
def extend(run_id: RunId, asked: Extension, services: ServicesDep) -> RunOut:
    """Give a run more steps or more answers; a finished one is queued again."""
    with services.database.write() as session:
        extend_run(session, run_id, total_steps=asked.total_steps, budget=asked.budget)
    return _show(services, run_id)


@router.post("/runs/{run_id}/goal", tags=["runs"], responses=UNKNOWN)
def new_goal(run_id: RunId, asked: NewGoal, services: ServicesDep) -> GoalOut:
    """Put better what labellers look for: a new version of the goal card."""
    with services.database.write() as session:
        return GoalOut.model_validate(change_goal(session, run_id, asked.text))


def _steer(services: Services, run_id: str, use_case: Callable[[Session, str], Run]) -> RunOut:
    with services.database.write() as session:
        use_case(session, run_id)
    return _show(services, run_id)


def _show(services: Services, run_id: str) -> RunOut:
    with services.database.read() as session:
        return run_out(overview(session, run_id), utc_now())
