"""The dashboard: every experiment and run in one look, and the form that starts another."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from fastapi import APIRouter, Request
from pydantic import TypeAdapter, ValidationError
from starlette.responses import RedirectResponse, Response

from labels_db.experiment_overview import experiments
from labels_db.models import ALIVE, utc_now
from labels_db.overrides import SettingError, with_kinds
from labels_db.overview import single_overviews
from labels_db.presets import Preset, presets
from server.api_requests import GoalText, Title
from server.experiment_view import experiment_view
from server.forms import Typed
from server.new_run import chosen_config, chosen_preset, queue_run
from server.run_form import chosen_values, complaints, fill_form, settings_in, wording
from server.run_view import RunView, view
from server.services import Services, ServicesDep
from server.templating import render

router = APIRouter(include_in_schema=False)

_WORDS: Mapping[str, TypeAdapter[str]] = {"title": TypeAdapter(Title), "goal": TypeAdapter(GoalText)}


@dataclass(frozen=True)
class PresetGroup:
    """Presets that are answered by people, or by scripts."""

    title: str
    text: str
    people: bool

    @property
    def presets(self) -> list[Preset]:
        return [preset for preset in presets().values() if preset.config().asks_people is self.people]


GROUPS = (
    PresetGroup(
        "Teach a behaviour yourself",
        "You answer some fifty pairs, a few at a time, while the robot practises. About half an hour.",
        people=True,
    ),
    PresetGroup(
        "Let a scripted teacher do it",
        "A script that knows the task's true reward answers at once. Good for a first look.",
        people=False,
    ),
)


@router.get("/")
def dashboard(request: Request, services: ServicesDep) -> Response:
    """Every experiment, every run that belongs to none, and the ways to start one."""
    now = utc_now()
    with services.database.read() as session:
        runs = sorted((view(seen, now) for seen in single_overviews(session)), key=_rank)
        shown = sorted(map(experiment_view, experiments(session)), key=lambda each: each.over)
    first = not runs and not shown
    return render(request, "dashboard.html", runs=runs, experiments=shown, groups=GROUPS, first=first)


def _rank(shown: RunView) -> tuple[int, int]:
    """Runs that go on first, then the queue in its order, then the ended; otherwise as they come."""
    if shown.run.state in ALIVE:
        return (0, 0)
    return (1, shown.seen.queue_position) if shown.seen.queue_position else (2, 0)


@router.get("/new")
def new(request: Request, services: ServicesDep, preset: str = "", profile: str = "") -> Response:
    """The form of a preset, with whatever the address already says."""
    if not preset:
        return render(request, "new.html", form=None, groups=GROUPS, first=True)
    given = chosen_values(request.query_params)
    return _form(request, services, chosen_preset(preset), profile, given, {})


@router.post("/new")
def create(request: Request, services: ServicesDep, typed: Typed) -> Response:
    """Queue the run that the form describes, or show the form again with what is wrong."""
    preset, profile = chosen_preset(typed.get("preset", "")), typed.get("profile", "")
    errors, given = _word_errors(typed), chosen_values(typed)
    try:
        shape = with_kinds(chosen_config(preset, profile or None, {}), given)
        config = chosen_config(preset, profile or None, settings_in(shape, given))
    except SettingError as error:
        errors |= complaints(error)
    if errors:
        return _form(request, services, preset, profile, given, errors)
    title, goal = wording(config, typed)
    with services.database.write() as session:
        run = queue_run(session, preset, config, title=title.strip(), goal=goal.strip())
    return RedirectResponse(f"/runs/{run.id}", status_code=303)


def _form(
    request: Request,
    services: Services,
    preset: Preset,
    profile: str,
    given: Mapping[str, str],
    errors: Mapping[str, str],
) -> Response:
    chosen_config(preset, profile or None, {})
    form = fill_form(preset, profile or next(iter(preset.profiles)), given, errors, services.data.path)
    return render(request, "new.html", status=422 if errors else 200, form=form, groups=GROUPS, first=False)


def _word_errors(typed: Mapping[str, str]) -> dict[str, str]:
    """What is wrong with the name and the goal."""
    errors = {}
    for name, words in _WORDS.items():
        try:
            words.validate_python(typed.get(name, ""))
        except ValidationError as error:
            errors[name] = _word_error(error)
    return errors


def _word_error(error: ValidationError) -> str:
    found = error.errors()[0]
    plain = {
        "string_too_short": "is missing",
        "string_too_long": f"may have {found.get('ctx', {}).get('max_length')} characters at most",
    }
    return plain.get(found["type"]) or found["msg"].removeprefix("Value error, ")
