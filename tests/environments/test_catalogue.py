"""The catalogue is what the simulators say."""

from __future__ import annotations

import itertools
import statistics

import pytest

from labels_db.catalogue import catalogue
from labels_db.presets import preset_named
from trainer.environments import Environment, make_environment
from trainer.environments.catalogue import PATH, catalogue_text


def test_the_committed_catalogue_is_up_to_date() -> None:
    how = "run `python -m trainer.environments.catalogue`"
    assert PATH.read_text(encoding="utf-8") == catalogue_text(), how


def test_every_goal_is_one_sentence_of_its_own_kind() -> None:
    for entry in catalogue().values():
        assert entry.goal.startswith("Prefer the clip in which "), entry.name
        assert entry.goal.count(".") == 1
        assert entry.goal.endswith("."), entry.name
    titles = [entry.title for entry in catalogue().values()]
    assert len(set(titles)) == len(titles)


def test_every_task_of_the_suite_is_there() -> None:
    from trainer.environments import without_gl

    with without_gl():
        from dm_control import suite
    assert {f"dmc:{domain}-{task}" for domain, task in suite.ALL_TASKS} <= catalogue().keys()


def episode_steps(environment: Environment, seed: int) -> int:
    """Control steps of an episode with random actions."""
    environment.reset(seed=seed)
    for step in itertools.count(1):
        _, _, terminated, truncated, _ = environment.step(environment.action_space.sample())
        if terminated or truncated:
            return step
    raise AssertionError("an episode has no end")


@pytest.mark.parametrize(
    "name",
    [
        name
        for name, known in catalogue().items()
        if known.ends_early
        and "Bipedal" not in name
        and "Lunar" not in name  # whose every moment costs a picture
    ],
)
def test_random_episodes_last_as_long_as_the_catalogue_says(name: str) -> None:
    config = preset_named(name).config().environment
    environment = make_environment(config.model_copy(update={"action_repeat": 1}))
    environment.action_space.seed(0)
    said = catalogue()[name].random_steps
    lasted = [episode_steps(environment, seed) for seed in range(-(-1500 // said))]
    environment.close()
    assert said / 1.4 <= statistics.median(lasted) <= 1.4 * said
