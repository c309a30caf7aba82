"""Starting a run from a preset: what the API and the form have in common."""

from __future__ import annotations

from collections.abc import Mapping

from sqlalchemy.orm import Session

from labels_db.models import Run
from labels_db.overrides import SettingError, with_settings
from labels_db.presets import Preset, preset_named
from labels_db.run_config import RunConfig
from labels_db.runs import request_run


def chosen_preset(name: str) -> Preset:
    """The preset of that name; SettingError otherwise."""
    try:
        return preset_named(name)
    except ValueError as error:
        raise SettingError("preset", str(error)) from error


def chosen_config(preset: Preset, profile: str | None, settings: Mapping[str, str]) -> RunConfig:
    """The profile's configuration with those settings; SettingError names what does not fit."""
    try:
        config = preset.config(profile)
    except ValueError as error:
        raise SettingError("profile", str(error)) from error
    return with_settings(config, settings)


def queue_run(
    session: Session, preset: Preset, config: RunConfig, *, title: str | None, goal: str | None
) -> Run:
    """Queue it, under its environment's own title and goal where none are given."""
    known = config.catalogue_entry
    return request_run(
        session, config, title=title or known.title, goal=goal or known.goal, preset=preset.name
    )
