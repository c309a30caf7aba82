"""Ready configurations: a task, what people are asked to look for, and a profile for each purpose."""

from __future__ import annotations

import difflib
import functools

from labels_db.catalogue import catalogue
from labels_db.presets.behaviours import behaviours
from labels_db.presets.by_environment import of_environment
from labels_db.presets.locomotion import locomotion
from labels_db.presets.manipulation import manipulation
from labels_db.presets.preset import PROFILES, Preset
from labels_db.presets.small import small_tasks

__all__ = ["PROFILES", "Preset", "preset_named", "presets"]


@functools.cache
def presets() -> dict[str, Preset]:
    """Every preset by name, in the order they are shown."""
    made = (*behaviours(), *small_tasks(), *locomotion(), *manipulation())
    return {preset.name: preset for preset in made}


def _way_in(name: str) -> str:
    """What an installation may have of its own is added first."""
    addable = name.startswith(("gym:", "installed:", "behaviour:"))
    return f", or add it with `pebble environments --add {name}`" if addable else ""


def preset_named(name: str) -> Preset:
    """The preset of that name, or one for the environment of that name; ValueError names the closest."""
    found = presets().get(name) or of_environment(name)
    if found is None:
        close = difflib.get_close_matches(name, [*presets(), *catalogue()], n=1) or list(presets())
        raise ValueError(f"preset {name!r}: unknown; one of {', '.join(close)}{_way_in(name)}")
    return found
