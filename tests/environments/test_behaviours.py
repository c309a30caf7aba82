"""The windmill: what is rewarded and counted, by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from labels_db.run_config import Behaviour
from tests.environments.given import started
from trainer.environments import Environment

WAYS = [("clockwise", 1), ("counter-clockwise", -1)]
STILL = np.zeros(1, np.float32)


def windmill(way: str) -> Environment:
    return started(Behaviour(behaviour=f"cartpole-windmill-{way}"))


@pytest.mark.parametrize(("way", "sign"), WAYS)
@pytest.mark.parametrize(("velocity", "expected"), [(-9.0, 0.0), (4 * math.pi, 0.5), (60.0, 1.0)])
def test_reward_grows_with_the_wished_velocity(way: str, sign: int, velocity: float, expected: float) -> None:
    environment = windmill(way)
    environment.scene.data.qvel[1] = sign * velocity
    _, reward, *_ = environment.step(STILL)
    assert reward == pytest.approx(expected, abs=0.02)  # gravity changes the speed within the step
    after = sign * environment.scene.data.qvel[1] / (8 * math.pi)
    assert reward == pytest.approx(min(max(after, 0.0), 1.0))


@pytest.mark.parametrize(("way", "sign"), WAYS)
def test_turns_are_the_angle_gone_since_the_start(way: str, sign: int) -> None:
    environment = windmill(way)
    start = environment.scene.data.qpos[1]
    environment.scene.data.qvel[1] = 20.0
    for _ in range(150):
        *_, info = environment.step(STILL)
    gone = (environment.scene.data.qpos[1] - start) / (2 * math.pi)
    assert abs(gone) > 3
    assert info["measures"]["turns"] == pytest.approx(sign * gone)


def test_turns_go_on_after_a_resume() -> None:
    first, second = windmill("clockwise"), windmill("clockwise")
    first.scene.data.qvel[1] = 20.0
    for _ in range(100):
        first.step(STILL)
    second.set_state(first.get_state())
    assert first.step(STILL)[4] == second.step(STILL)[4]


def test_a_reset_starts_counting_anew() -> None:
    environment = windmill("clockwise")
    environment.scene.data.qvel[1] = 20.0
    environment.step(STILL)
    _, info = environment.reset(seed=4)
    assert info["measures"] == {"turns": 0.0}
