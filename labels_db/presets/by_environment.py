"""Presets for environments that have none of their own: the settings that their family usually has."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from labels_db.catalogue import catalogue
from labels_db.presets.behaviours import novel
from labels_db.presets.locomotion import laptop
from labels_db.presets.manipulation import manipulating
from labels_db.presets.preset import Preset
from labels_db.run_config import DMControl, EnvironmentConfig, Gymnasium, InstalledEnvironment, RunConfig

STEPS = 160_000
SHORT_EPISODES = 100
"""In the pool where they are short: the usual 20 would hold a few hundred steps."""


def of_environment(name: str) -> Preset | None:
    """The preset of an environment by its name in the catalogue, as in gym:Hopper-v5; None if that has no such name."""
    family, _, called = name.partition(":")
    return FAMILIES[family](called) if name in catalogue() else None


def _laptop(environment: EnvironmentConfig) -> RunConfig:
    """Segments of a second, or of two thirds of what half of the random episodes last.

    Almost every episode has that many, also of a policy that falls sooner than chance: longer segments would come from
    lucky episodes only, or from none. A hopper, 125 steps a second, is down after 20: a tenth of a second is little to
    see, but it shows which way it falls.
    """
    config = laptop(environment, STEPS)
    lasts = config.catalogue_entry.random_steps // environment.action_repeat
    short = max(1, 2 * lasts // 3)
    if not lasts or short >= config.segment_steps:
        return config
    changes = {"segment_steps": short, "pool_episodes": SHORT_EPISODES}
    return config.model_copy(update={"feedback": config.feedback.model_copy(update=changes)})


def _suite(task: str) -> Preset:
    return Preset(f"dmc:{task}", {"laptop": _laptop(DMControl(task=task, action_repeat=4))})


def _gymnasium(id: str) -> Preset:
    return Preset(f"gym:{id}", {"laptop": _laptop(Gymnasium(id=id))})


def _installed(name: str) -> Preset:
    return Preset(f"installed:{name}", {"laptop": _laptop(InstalledEnvironment(environment=name))})


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
