"""Whole small runs of agents, teachers, schemes and rewards in combination: each pair of kinds meets."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import select

from labels_db.methods import method_named, methods
from labels_db.models import Query, RunState
from labels_db.overrides import with_settings
from labels_db.presets import preset_named
from labels_db.records import fits_of
from labels_db.run_config import RunConfig, Sessions
from tests.trainer.conftest import RUN, Lab, new_lab, small_config
from tests.trainer.whole_runs import goes_on_exactly
from trainer.query_selection import SCHEMES
from trainer.teachers import KINDS

pytestmark = pytest.mark.contracts

AGENTS = ("sac", "ppo")
RELABELS = (True, False)
TEACHERS = tuple(KINDS)
ALL_SCHEMES = tuple(config().kind for config in SCHEMES)

PENDULUM: dict[str, Any] = {  # the cheapest to simulate: 50 steps an episode, 5 a second
    "environment__kind": "gym",
    "environment__id": "Pendulum-v1",
    "environment__action_repeat": 4,
}
PPO = {
    "agent.kind": "ppo",
    "agent.depth": "1",
    "agent.rollout_steps": "20",
    "agent.epochs": "1",
    "agent.exploring_epochs": "1",
    "environments": "3",
    "exploration.seed_steps": "0",
}

COMBINED = [
    (teacher, scheme, AGENTS[(t + s) % 2], RELABELS[(t + s // 2) % 2])
    for t, teacher in enumerate(TEACHERS)
    for s, scheme in enumerate(ALL_SCHEMES)
]


def test_each_pair_of_kinds_meets() -> None:
    kinds = (TEACHERS, ALL_SCHEMES, AGENTS, RELABELS)
    for one, other in combinations(range(4), 2):
        met = {(row[one], row[other]) for row in COMBINED}
        assert len(met) == len(kinds[one]) * len(kinds[other])


def shorter(config: RunConfig, **changes: Any) -> RunConfig:
    return with_settings(config, {path.replace("__", "."): str(value) for path, value in changes.items()})


@pytest.mark.parametrize(("teacher", "scheme", "agent", "relabel"), COMBINED)
def test_a_combination_runs_to_its_end(
    tmp_path: Path, teacher: str, scheme: str, agent: str, relabel: bool
) -> None:
    config = small_config(
        **PENDULUM,
        feedback__teacher__kind=teacher,
        feedback__scheme__kind=scheme,
        reward__relabel=relabel,
        reward__max_epochs=1,
        evaluation__every=1000,
        evaluation__episodes=1,
        exploration__seed_steps=60,
        exploration__explore_steps=70,
        total_steps=330,
        feedback__steps_between=40,
    )
    if agent == "ppo":
        config = with_settings(config, PPO)
    assert isinstance(config.feedback, Sessions)
    assert config.feedback.teacher == type(config.feedback.teacher)()  # with its own faults
    lab = new_lab(tmp_path / "data")
    lab.request(config)
    assert lab.live() is RunState.FINISHED
    with lab.database.read() as session:
        asked = session.scalars(select(Query.scheme)).all()
        fits = fits_of(session, RUN)
    assert asked == ["uniform"] * 4 + [scheme] * 8 or teacher == "skip"
    assert len(fits) == 3 or teacher == "skip"
    lab.database.close()


METHODS = (
    "ppo",
    "preference-ppo",
    "preference-ppo-pretrained",
    "pebble-no-pretraining",
    "pebble-increasing",
)
SMALL_PPO = {"agent.rollout_steps": "30", "environments": "3", "evaluation.every": "400", "agent.epochs": "2"}
SMALL = {
    **{path.replace("__", "."): str(value) for path, value in PENDULUM.items()},
    "agent.width": "16",
    "agent.batch_size": "16",
    "total_steps": "700",
    "evaluation.every": "400",
    "evaluation.episodes": "1",
    "evaluation.video": "none",
}
SMALL_EXPLORATION = {"exploration.seed_steps": "130", "exploration.explore_steps": "170"}
SMALL_FEEDBACK = {
    "reward.width": "16",
    "reward.max_epochs": "3",
    "feedback.budget": "12",
    "feedback.queries_per_session": "4",
    "feedback.steps_between": "100",
}


def of_method(name: str) -> RunConfig:
    method = method_named(name)
    config = preset_named("cartpole-swingup").config()
    config = with_settings(config, {**SMALL, **SMALL_FEEDBACK, **SMALL_EXPLORATION})
    if method.on_policy:
        config = with_settings(config, {**PPO, **SMALL_PPO})
    return with_settings(config, method.settings)


@pytest.mark.parametrize("name", METHODS)
def test_a_method_goes_on_exactly_from_any_stop(tmp_path: Path, name: str) -> None:
    goes_on_exactly(of_method(name), tmp_path, 500)


def test_so_does_one_whose_environments_end_their_episodes_at_different_times(tmp_path: Path) -> None:
    hopper = {"environment.kind": "gym", "environment.id": "Hopper-v5", "environment.action_repeat": "1"}
    config = with_settings(of_method("preference-ppo"), {**hopper, "feedback.segment_steps": "5"})
    end = goes_on_exactly(config, tmp_path, 500)
    assert len(end.fits) == 3
    ended = [step for name, step, _ in end.rows["metrics"] if name == "episode_return"]
    assert len(set(ended)) > len(ended) / 2 > 5


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(methods().keys() - set(METHODS)))
def test_so_does_every_other_method(tmp_path: Path, name: str) -> None:
    goes_on_exactly(of_method(name), tmp_path, 500)


def test_without_relabelling_stored_rewards_stay(lab: Lab) -> None:
    from trainer.replay_buffer import ReplayBuffer

    lab.request(of_method("pebble-no-relabel"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ReplayBuffer, "relabel", lambda *_: pytest.fail("a reward was written anew"))
        assert lab.live() is RunState.FINISHED
