"""Every environment and every preset: it starts, learns, asks, relabels, and goes on exactly from a stop.

`make contracts` runs these; the quick suite has one of each family.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from pathlib import Path

import pytest

from labels_db.catalogue import catalogue
from labels_db.methods import method_named
from labels_db.overrides import with_settings
from labels_db.presets import preset_named, presets
from labels_db.run_config import RunConfig
from tests.trainer.whole_runs import goes_on_exactly
from trainer.environments import Environment, make_environment

SMALL: Mapping[str, str] = {
    "environment.action_repeat": "16",
    "agent.width": "8",
    "agent.batch_size": "8",
    "reward.width": "8",
    "reward.max_epochs": "1",
    "exploration.seed_steps": "20",
    "exploration.explore_steps": "20",
    "exploration.reset_updates": "2",
    "feedback.teacher.kind": "oracle",
    "feedback.budget": "4",
    "feedback.queries_per_session": "2",
    "feedback.steps_between": "30",
    "feedback.segment_steps": "5",
    "evaluation.every": "100000",
    "evaluation.episodes": "1",
    "evaluation.video": "none",
}
SMALL_AGENTS: Mapping[str, Mapping[str, str]] = {
    "pebble": {"agent.replay_capacity": "1000"},
    "preference-ppo-pretrained": {
        "exploration.seed_steps": "0",
        "agent.rollout_steps": "8",
        "agent.epochs": "1",
        "agent.exploring_epochs": "1",
        "environments": "2",
    },
}
SETTING = {"dmc": "task", "behaviour": "behaviour", "metaworld": "task", "gym": "id"}
ONE_OF_EACH = {
    "dmc:reacher-easy",
    "behaviour:quadruped-wave-left-front",
    "metaworld:drawer-close",
    "gym:Hopper-v5",
    "gym:Pendulum-v1",
}


def of_environment(name: str) -> RunConfig:
    """Actions are held as long as episodes still have two segments, and steps suffice for several episodes."""
    kind, _, value = name.partition(":")
    settings = {
        **SMALL,
        **SMALL_AGENTS["pebble"],
        "environment.kind": kind,
        f"environment.{SETTING[kind]}": value,
    }
    for repeat in ("16", "4", "1"):
        held = {**settings, "environment.action_repeat": repeat, "feedback.segment_steps": "1"}
        config = with_settings(preset_named("walker-walk").config(), held)
        if (shortest := by_chance(config)) >= 10:
            break
    whole = -(-catalogue()[name].episode_steps // int(repeat))  # who has begun to learn may stay up
    lengths = {"total_steps": str(whole + 200), "feedback.segment_steps": str(min(5, shortest // 2))}
    return with_settings(config, lengths)


def by_chance(config: RunConfig) -> int:
    """Steps of the shortest of three episodes with random actions: whoever can fall soon does."""
    environment = make_environment(config.environment)
    environment.action_space.seed(0)
    lasted = [steps_of_an_episode(environment, seed) for seed in range(3)]
    environment.close()
    return min(lasted)


def steps_of_an_episode(environment: Environment, seed: int) -> int:
    environment.reset(seed=seed)
    for step in itertools.count(1):
        _, _, terminated, truncated, _ = environment.step(environment.action_space.sample())
        if terminated or truncated:
            return step
    raise AssertionError("an episode has no end")


def learns_and_goes_on_exactly(config: RunConfig, folder: Path) -> None:
    """Stopped after its first session, it asks, learns and relabels once more."""
    assert len(goes_on_exactly(config, folder).fits) == 2


@pytest.mark.contracts
@pytest.mark.parametrize("name", sorted(ONE_OF_EACH))
def test_one_environment_of_each_family(name: str, tmp_path: Path) -> None:
    learns_and_goes_on_exactly(of_environment(name), tmp_path)


@pytest.mark.slow
@pytest.mark.contracts
@pytest.mark.parametrize("name", sorted(catalogue().keys() - ONE_OF_EACH))
def test_every_environment(name: str, tmp_path: Path) -> None:
    learns_and_goes_on_exactly(of_environment(name), tmp_path)


@pytest.mark.slow
@pytest.mark.contracts
@pytest.mark.parametrize("method", SMALL_AGENTS)
@pytest.mark.parametrize("name", presets())
def test_every_preset_in_every_profile(name: str, method: str, tmp_path: Path) -> None:
    preset = preset_named(name)
    for profile in preset.profiles:
        config, small = method_named(method).config(preset, profile), {**SMALL, **SMALL_AGENTS[method]}
        steps = -(-config.catalogue_entry.episode_steps // 16) * int(small.get("environments", 1))
        changes = {**small, "total_steps": str(2 * steps + 120), "feedback.kind": "sessions"}
        learns_and_goes_on_exactly(with_settings(config, changes), tmp_path / profile)
