"""Every environment and every preset: it starts, learns, asks, relabels, and goes on exactly from a stop.

`make contracts` runs these; the quick suite has one of each family.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from labels_db.catalogue import catalogue
from labels_db.methods import method_named
from labels_db.overrides import with_settings
from labels_db.presets import preset_named, presets
from labels_db.run_config import RunConfig
from tests.trainer.whole_runs import goes_on_exactly

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
    kind, _, value = name.partition(":")
    base, known = preset_named("walker-walk").config(), catalogue()[name]
    ends_soon = (
        known.ends_early and kind == "gym"
    )  # whom chance moves falls; lqr's masses never come to rest by it
    repeat = 1 if ends_soon else 16  # or episodes would be over before a segment is
    steps = 100 if ends_soon else -(-known.episode_steps // repeat)
    lengths = {
        "environment.action_repeat": str(repeat),
        "total_steps": str(2 * steps + 120),
        "feedback.segment_steps": str(min(5, max(1, steps // 2))),
    }
    return with_settings(
        base,
        {
            **SMALL,
            **SMALL_AGENTS["pebble"],
            **lengths,
            "environment.kind": kind,
            f"environment.{SETTING[kind]}": value,
        },
    )


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
