"""The form of a new run: a preset's configuration as fields with words, bounds, values and complaints."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path

from pydantic import ValidationError

from labels_db.catalogue import catalogue
from labels_db.config_fields import ConfigField, fields_of
from labels_db.estimate import estimate_bytes
from labels_db.numbers import number
from labels_db.overrides import SettingError, setting_errors, with_kinds
from labels_db.presets import Preset
from labels_db.run_config import EnvironmentConfig, RunConfig
from server.new_run import chosen_config
from server.words import size

A_LOT = 1_000_000
"""Upper bounds from here on keep mistakes out; nobody needs to read them."""


@dataclass(frozen=True)
class FormField:
    """One setting as the form shows it: `text` is what was typed, or the value it has."""

    setting: ConfigField
    text: str
    error: str = ""
    suggestions: Sequence[str] = ()
    """What it may be, where that is too much to choose from."""

    @property
    def path(self) -> str:
        return self.setting.path

    @property
    def type(self) -> str:
        return self.setting.type

    @property
    def optional(self) -> bool:
        return self.setting.optional

    @property
    def description(self) -> str:
        meaning = self.setting.choices.get(self.text, "") if self.is_kind else ""
        return meaning or self.setting.description

    @property
    def is_kind(self) -> bool:
        return self.path.endswith(".kind")

    @property
    def label(self) -> str:
        """The setting's own name; a kind is named after the part it chooses."""
        name = self.path.split(".")[-2 if self.is_kind else -1]
        return name.replace("_", " ").capitalize()

    @property
    def options(self) -> list[tuple[str, str]]:
        return [(word, word.replace("-", " ").capitalize()) for word in self.setting.choices]

    @property
    def bounds(self) -> str:
        return bounds(self.setting)


@dataclass(frozen=True)
class Section:
    """A part of the configuration."""

    title: str
    description: str
    fields: list[FormField]


@dataclass(frozen=True)
class RunForm:
    """A whole form: settings typed so far, and what is wrong with them."""

    preset: Preset
    profile: str
    title: str
    goal: str
    fields: list[FormField]
    errors: Mapping[str, str] = field(default_factory=dict)
    room: str = ""
    caveats: Sequence[str] = ()

    @property
    def primary(self) -> list[FormField]:
        return [shown for shown in self.fields if shown.setting.primary]

    @property
    def sections(self) -> list[Section]:
        rest = [shown for shown in self.fields if not shown.setting.primary]
        return [_section(name, list(group)) for name, group in groupby(rest, lambda f: f.setting.section)]

    @property
    def general_errors(self) -> list[str]:
        """Complaints that belong to no field shown."""
        known = {shown.path for shown in self.fields} | {"title", "goal"}
        return [
            f"{path}: {text}" if path else text for path, text in self.errors.items() if path not in known
        ]

    @property
    def open(self) -> bool:
        """Whether a setting that is usually tucked away needs attention."""
        return any(shown.error for shown in self.fields if not shown.setting.primary)


def _section(name: str, fields: list[FormField]) -> Section:
    description = RunConfig.model_fields[name].description if name else "What belongs to no single part."
    return Section(name.capitalize() if name else "The run", description or "", fields)


def bounds(setting: ConfigField) -> str:
    """The range of a number in words: "From 1 to 16", "More than 0, at most 0.1"."""
    low, high = setting.minimum, setting.maximum
    if low is None or high is None:
        return ""
    if high >= A_LOT:
        return f"{'More than' if setting.open_minimum else 'At least'} {_figure(low)}"
    if setting.open_minimum:
        return f"More than {_figure(low)}, at most {_figure(high)}"
    return f"From {_figure(low)} to {_figure(high)}"


def _figure(value: float) -> str:
    return number(int(value)) if value == int(value) else f"{value:g}"


SHOWN = ".shown"
"""Ends the name of a hidden field: of which kind the fields beside it are, as they were sent to the browser."""


def chosen_values(given: Mapping[str, str]) -> dict[str, str]:
    """What somebody chose: where they chose another kind, the old kind's defaults that were sent along are not."""
    shown = {path.removesuffix(SHOWN): kind for path, kind in given.items() if path.endswith(SHOWN)}
    left = tuple(path.removesuffix("kind") for path, kind in shown.items() if given.get(path, kind) != kind)
    usual = {setting.path: _text(setting) for setting in fields_of(with_kinds(RunConfig(), shown))}
    return {
        path: value
        for path, value in given.items()
        if not path.endswith(SHOWN)
        and not (path.startswith(left) and path not in shown and usual.get(path) == value)
    }


def fill_form(
    preset: Preset, profile: str, given: Mapping[str, str], errors: Mapping[str, str], folder: Path
) -> RunForm:
    """The form for what was typed so far: other kinds bring other fields."""
    shape = with_kinds(preset.config(profile), given)
    config = _wanted(preset, profile, settings_in(shape, given))
    title, goal = wording(config or preset.config(profile), given)
    suggested = _suggested(shape.environment)
    return RunForm(
        preset=preset,
        profile=profile,
        title=title,
        goal=goal,
        fields=[_field(setting, given, errors, suggested) for setting in fields_of(shape)],
        errors=errors,
        room=_room(config, folder) if config else "",
        caveats=config.caveats if config else [],
    )


def wording(config: RunConfig, given: Mapping[str, str]) -> tuple[str, str]:
    """Title and goal as they were typed; words that another environment had brought give way to the chosen one's."""
    known, brought = config.catalogue_entry, catalogue().values()
    title, goal = given.get("title", known.title), given.get("goal", known.goal)
    return (
        known.title if title in {other.title for other in brought} else title,
        known.goal if goal in {other.goal for other in brought} else goal,
    )


def _text(setting: ConfigField) -> str:
    """A setting's value as the form shows it."""
    value = "" if setting.value is None else str(setting.value)
    return value.lower() if setting.type == "bool" else value


def _suggested(environment: EnvironmentConfig) -> dict[str, list[str]]:
    """For the setting that names the environment, every one of its family."""
    family = f"{environment.kind}:"
    names = [name.removeprefix(family) for name in catalogue() if name.startswith(family)]
    return {f"environment.{environment.what}": names}


def _field(
    setting: ConfigField,
    given: Mapping[str, str],
    errors: Mapping[str, str],
    suggested: Mapping[str, Sequence[str]],
) -> FormField:
    value = _text(setting)
    # A kind that does not exist was passed over when the form took its shape.
    text = value if setting.path.endswith(".kind") else given.get(setting.path, value)
    return FormField(setting, text, errors.get(setting.path, ""), suggested.get(setting.path, ()))


def settings_in(shape: RunConfig, given: Mapping[str, str]) -> dict[str, str]:
    """Those of the values given that the configuration has a place for."""
    return {setting.path: given[setting.path] for setting in fields_of(shape) if setting.path in given}


def _wanted(preset: Preset, profile: str, settings: Mapping[str, str]) -> RunConfig | None:
    """None while something in it is wrong."""
    try:
        return chosen_config(preset, profile, settings)
    except SettingError:
        return None


def _room(config: RunConfig, folder: Path) -> str:
    needed = estimate_bytes(config).total
    return f"Needs at most about {size(needed)} of disk; {size(shutil.disk_usage(folder).free)} are free."


def complaints(error: SettingError) -> dict[str, str]:
    """Everything wrong with the settings, by path."""
    cause = error.__cause__
    found = setting_errors(cause) if isinstance(cause, ValidationError) else [error]
    return {each.path: each.message for each in reversed(found)}
