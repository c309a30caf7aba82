"""What every environment promises: exact resume, episodes made of their seed, shapes and times."""

from __future__ import annotations

import numpy as np
import pytest

from labels_db.catalogue import entry
from tests.environments.given import META_WORLD, QUICK, SAMPLE, Config, actions, lived, name, started
from trainer.environments import Environment, EnvironmentState, make_environment


def assert_same_future(first: Environment, second: Environment, steps: int) -> None:
    """Step by step, until the episode ends."""
    for action in actions(first, steps):
        mine, theirs = first.step(action), second.step(action)
        np.testing.assert_array_equal(mine[0], theirs[0])
        assert mine[1:] == theirs[1:]
        np.testing.assert_array_equal(first.physics_state(), second.physics_state())
        if mine[2] or mine[3]:
            break


def assert_resumes(config: Config) -> None:
    """50 steps in, through JSON, into an environment that was elsewhere: 100 steps bit by bit the same."""
    first, second = started(config, seed=7), started(config, seed=99)
    lived(first, 50)
    observation = second.set_state(EnvironmentState.from_json(first.get_state().to_json()))
    np.testing.assert_array_equal(observation, first.get_state().observation)
    assert_same_future(first, second, 100)


@pytest.mark.parametrize("config", SAMPLE, ids=name)
def test_resume_is_exact(config: Config) -> None:
    assert_resumes(config)


@pytest.mark.contracts
@pytest.mark.parametrize("config", QUICK, ids=name)
def test_resume_is_exact_everywhere(config: Config) -> None:
    assert_resumes(config)


@pytest.mark.contracts
@pytest.mark.slow
@pytest.mark.parametrize("config", META_WORLD, ids=name)
def test_resume_is_exact_all_over_meta_world(config: Config) -> None:
    assert_resumes(config)


@pytest.mark.parametrize("config", SAMPLE, ids=name)
def test_a_seed_determines_its_episode(config: Config) -> None:
    first, second = make_environment(config), started(config, seed=99)
    second.step(actions(second, 1)[0])
    start, _ = first.reset(seed=2**40 + 1)
    again, _ = second.reset(seed=2**40 + 1)
    np.testing.assert_array_equal(start, again)
    assert_same_future(first, second, 20)
    other, _ = first.reset(seed=5)
    assert not np.array_equal(other, start)


@pytest.mark.parametrize("config", SAMPLE, ids=name)
def test_sizes_are_those_of_the_catalogue(config: Config) -> None:
    environment, known = started(config), entry(config.name)
    observation, reward, *_ = environment.step(actions(environment, 1)[0])
    assert observation.dtype == np.float32
    assert observation in environment.observation_space
    assert isinstance(reward, float)
    assert observation.shape == (known.observation_size,)
    assert environment.action_space.shape == (known.action_size,)
    assert environment.physics_state().shape == (known.state_size,) == (environment.state_size,)
    assert environment.physics_state().dtype == np.float64


@pytest.mark.parametrize("config", SAMPLE, ids=name)
def test_a_held_action_can_be_drawn_control_step_by_control_step(config: Config) -> None:
    """Three control steps under one action go through the states that they go through one by one."""
    held, single = (started(config.model_copy(update={"action_repeat": n})) for n in (3, 1))
    (action,) = actions(held, 1)
    held.step(action)
    one_by_one = [single.physics_state()]
    for _ in range(3):
        single.step(action)
        one_by_one.append(single.physics_state())
    np.testing.assert_array_equal(held.moments, one_by_one[:3])
    np.testing.assert_array_equal(held.physics_state(), one_by_one[3])


def test_an_episode_that_ends_in_the_middle_of_a_hold_has_as_many_moments() -> None:
    environment = started(SAMPLE[0].model_copy(update={"action_repeat": 7}))
    over = False
    while not over:
        *_, terminated, truncated, _ = environment.step(actions(environment, 1)[0])
        over = terminated or truncated
    assert environment.episode_steps % 7
    assert environment.moments.shape == (7, environment.state_size)


def test_observations_are_not_overwritten_later() -> None:
    environment = started(SAMPLE[1])
    kept, *_ = environment.step(actions(environment, 1)[0])
    copy = kept.copy()
    environment.step(-actions(environment, 1)[0])
    np.testing.assert_array_equal(kept, copy)
