"""Every environment and every preset: it starts, learns, asks, relabels, and goes on exactly from a stop.

`make contracts` runs these; the quick suite has one of each family.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest
from sqlalchemy import select

from labels_db.catalogue import catalogue
from labels_db.methods import method_named
from labels_db.models import Event, RunState
from labels_db.overrides import with_settings
from labels_db.presets import preset_named, presets
from labels_db.records import fits_of
from labels_db.run_config import RunConfig
from tests.trainer.conftest import RUN, Lab
from tests.trainer.whole_runs import goes_on_exactly

LONG: Mapping[str, str] = {"environment.action_repeat": "16", "feedback.segment_steps": "5"}
"""For episodes that last: fewer, longer steps, and short segments of them."""
SMALL: Mapping[str, str] = {
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
ONE_OF_EACH = {
    "dmc:reacher-easy",
    "behaviour:quadruped-wave-left-front",
    "metaworld:drawer-close",
    "gym:Hopper-v5",
    "gym:Pendulum-v1",
}


ENDING_EARLY = sorted(name for name, known in catalogue().items() if known.ends_early)
DRAWN_AS_THEY_GO = {"gym:BipedalWalker-v3", "gym:LunarLanderContinuous-v3"}
"""Every moment costs a picture."""


def of_environment(name: str) -> RunConfig:
    """Its own preset made small, with steps for several episodes; where these can end early, with its own segments."""
    known = catalogue()[name]
    held = {} if known.ends_early else LONG
    if known.episode_steps < 160:
        held = {**held, "environment.action_repeat": "4"}
    config = with_settings(preset_named(name).config(), {**SMALL, **SMALL_AGENTS["pebble"], **held})
    whole = -(-known.episode_steps // config.environment.action_repeat)  # who has begun to learn may stay up
    return with_settings(config, {"total_steps": str(whole + 200)})


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
        config, small = (
            method_named(method).config(preset, profile),
            {**SMALL, **LONG, **SMALL_AGENTS[method]},
        )
        steps = -(-config.catalogue_entry.episode_steps // 16) * int(small.get("environments", 1))
        changes = {**small, "total_steps": str(2 * steps + 120), "feedback.kind": "sessions"}
        learns_and_goes_on_exactly(with_settings(config, changes), tmp_path / profile)


@pytest.mark.contracts
@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.slow if name in DRAWN_AS_THEY_GO else ()) for name in ENDING_EARLY],
)
def test_a_preset_asks_although_episodes_can_end_early(name: str, lab: Lab) -> None:
    """With its own segments and pool, after random actions only: nobody has learned to stay up yet."""
    lived = 2000
    changes = {
        **SMALL,
        "exploration.kind": "random",
        "exploration.seed_steps": str(lived),
        "feedback.budget": "2",
        "total_steps": str(lived + 1),
    }
    changes.pop("exploration.explore_steps")
    changes.pop("exploration.reset_updates")
    lab.request(with_settings(preset_named(name).config(), changes))
    assert lab.live() is RunState.FINISHED
    with lab.database.read() as session:
        assert [fit.step for fit in fits_of(session, RUN)] == [lived]
        assert not session.scalars(select(Event).where(Event.text.startswith("Nothing can be asked"))).all()
