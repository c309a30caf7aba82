"""Presets for environments that have none of their own: the settings that their family usually has."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from labels_db.catalogue import catalogue
from labels_db.presets.behaviours import novel
from labels_db.presets.locomotion import laptop
from labels_db.presets.manipulation import manipulating
from labels_db.presets.preset import Preset
from labels_db.run_config import DMControl, Gymnasium, InstalledEnvironment

STEPS = 160_000


def of_environment(name: str) -> Preset | None:
    """The preset of an environment by its name in the catalogue, as in gym:Hopper-v5; None if that has no such name."""
    family, _, called = name.partition(":")
    return FAMILIES[family](called) if name in catalogue() else None


def _suite(task: str) -> Preset:
    return Preset(f"dmc:{task}", {"laptop": laptop(DMControl(task=task, action_repeat=4), STEPS)})


def _gymnasium(id: str) -> Preset:
    return Preset(f"gym:{id}", {"laptop": laptop(Gymnasium(id=id), STEPS)})


def _installed(name: str) -> Preset:
    return Preset(f"installed:{name}", {"laptop": laptop(InstalledEnvironment(environment=name), STEPS)})


def _behaviour(name: str) -> Preset:
    return Preset(f"behaviour:{name}", {"laptop": novel(name)})


def _meta_world(task: str) -> Preset:
    return manipulating(f"metaworld:{task}", task)


FAMILIES: Mapping[str, Callable[[str], Preset]] = {
    "dmc": _suite,
    "gym": _gymnasium,
    "installed": _installed,
    "behaviour": _behaviour,
    "metaworld": _meta_world,
}
