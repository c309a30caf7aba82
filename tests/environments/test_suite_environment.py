"""Actions, repeats, endings and errors of the suite's environments."""

from __future__ import annotations

import json
import math
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from labels_db.run_config import Behaviour, DMControl
from tests.environments.given import actions, started
from trainer.environments import EnvironmentState, Observation, PhysicsState, make_environment
from trainer.environments.json_state import random_from_json, random_to_json

LOADED = "import sys; print([m for m in ('glfw', 'OpenGL', 'mujoco.egl', 'torch') if m in sys.modules])"


@pytest.mark.parametrize("action", [-1.0, 0.0, 0.5, 1.0])
def test_actions_are_rescaled_to_the_actuators(action: float) -> None:
    environment = started(DMControl(task="quadruped-walk"))
    low, high = environment.scene.model.actuator_ctrlrange.T
    environment.step(np.full(low.shape, action, np.float32))
    np.testing.assert_allclose(environment.scene.data.ctrl, low + (action + 1) / 2 * (high - low), atol=1e-12)


def test_actuators_without_limits_take_the_action_itself() -> None:
    environment = started(DMControl(task="lqr-lqr_6_2"))
    environment.step(np.array([0.25, -3.0], np.float32))
    np.testing.assert_array_equal(environment.scene.data.ctrl, [0.25, -1.0])


def test_a_repeated_action_adds_up_rewards() -> None:
    single = started(DMControl(task="cheetah-run"))
    repeated = started(DMControl(task="cheetah-run", action_repeat=4))
    action = actions(single, 1)[0]
    rewards = [single.step(action)[1] for _ in range(4)]
    observation, reward, *_ = repeated.step(action)
    assert reward == sum(rewards)
    np.testing.assert_array_equal(observation, single.get_state().observation)


@pytest.mark.parametrize("repeat", [1, 7])
def test_the_time_limit_truncates(repeat: int) -> None:
    environment = started(DMControl(task="pendulum-swingup", action_repeat=repeat))
    steps, over = 0, False
    while not over:
        _, _, terminated, over, _ = environment.step(np.zeros(1, np.float32))
        assert not terminated
        steps += 1
    assert steps == math.ceil(1000 / repeat)
    assert environment.get_state().step == 1000
    with pytest.raises(RuntimeError, match="reset"):
        environment.step(np.zeros(1, np.float32))


def test_discount_zero_terminates() -> None:
    environment = started(DMControl(task="lqr-lqr_2_1"))
    environment.scene.data.qpos[:] = environment.scene.data.qvel[:] = 0
    environment.set_state(environment.get_state())
    _, _, terminated, truncated, _ = environment.step(np.zeros(1, np.float32))
    assert terminated
    assert not truncated


def test_a_diverging_simulation_ends_the_episode() -> None:
    environment = started(DMControl(task="walker-walk"))
    before = environment.get_state().observation
    environment.scene.data.qvel[:] = np.nan
    observation, reward, terminated, truncated, _ = environment.step(np.zeros(6, np.float32))
    assert (reward, terminated, truncated) == (0.0, False, True)
    np.testing.assert_array_equal(observation, before)


def test_a_reset_without_a_seed_draws_one() -> None:
    environment = make_environment(DMControl(task="pendulum-swingup"))
    first, second = environment.reset()[0], environment.reset()[0]
    assert not np.array_equal(first, second)


def test_unknown_names_are_refused_with_the_known_ones() -> None:
    with pytest.raises(ValueError, match=r"dmc:walker-fly: unknown task; one of .*walker-walk"):
        make_environment(DMControl.model_construct(task="walker-fly"))
    with pytest.raises(ValueError, match=r"unknown behaviour; one of .*windmill"):
        make_environment(Behaviour.model_construct(behaviour="moonwalk"))


def test_a_state_of_another_robot_is_refused() -> None:
    environment = started(DMControl(task="walker-walk"))
    with pytest.raises(ValueError, match=r"shape \(3,\), but a state of walker-walk has shape \(91,\)"):
        environment.scene.restore(3, np.zeros(3))


def test_no_opengl_is_loaded() -> None:
    code = (
        "from labels_db.run_config import DMControl; from trainer.environments import make_environment;"
        f"make_environment(DMControl(task='quadruped-escape')).reset(seed=1); {LOADED}"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


doubles, singles = (arrays.arrays(kind, st.integers(0, 5)) for kind in (np.float64, np.float32))


@given(doubles, singles, st.integers(0, 2**64), st.integers(0, 1000), st.booleans())
def test_states_come_back_from_json_bit_by_bit(
    physics: PhysicsState, observation: Observation, seed: int, step: int, ended: bool
) -> None:
    state = EnvironmentState(seed, step, ended, physics, observation, {"normal": 0.1})
    back = EnvironmentState.from_json(state.to_json())
    assert back.physics.tobytes() == physics.tobytes()
    assert back.observation.tobytes() == state.observation.tobytes()
    assert (back.episode_seed, back.step, back.ended, back.random) == (seed, step, ended, {"normal": 0.1})


@given(st.integers(0, 2**32 - 1), st.integers(0, 7))
def test_generators_come_back_from_json(seed: int, draws: int) -> None:
    random, other = np.random.RandomState(seed), np.random.RandomState(0)
    random.randn(draws)
    random_from_json(other, json.loads(json.dumps(random_to_json(random))))
    np.testing.assert_array_equal(random.randn(5), other.randn(5))
