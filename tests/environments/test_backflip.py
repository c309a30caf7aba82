"""The hopper's backflip: what is rewarded and counted, by hand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from labels_db.run_config import Behaviour
from tests.environments.motions import SEED, Pose, judge, states_of, suite_environment
from trainer.environments.behaviours import Measures
from trainer.environments.behaviours.hopper import BODY
from trainer.environments.behaviours.shapes import clearances

TURN = 2 * math.pi
STEP = TURN / 50  # of 0.02 s: one turn a second, backward where negative
HIGH = 2.0  # metres above the pose of zeros, whose foot is 0.06 m off the floor


@pytest.fixture(scope="module")
def hopper() -> Any:
    return suite_environment(Behaviour(behaviour="hopper-backflip"))


def judged(hopper: Any, poses: Sequence[Pose]) -> tuple[list[float], Measures]:
    rewards, measures = judge(hopper, states_of(hopper, poses))
    return rewards, measures


def lying(hopper: Any, angle: float) -> Pose:
    """The straight hopper at this angle, as high as it takes for a part other than the foot to touch the floor."""
    states_of(hopper, [{"rooty": angle, "rootz": HIGH}])
    hopper.restore(SEED, hopper.physics_state())
    off = float(clearances(hopper._physics, BODY).min())
    return {"rooty": angle, "rootz": HIGH - off}


def test_turning_backward_in_the_air_is_worth_everything(hopper: Any) -> None:
    rewards, measures = judged(hopper, [{"rooty": -STEP * k, "rootz": HIGH} for k in range(120)])
    assert rewards == pytest.approx([1.0] * 119)
    assert measures == {"flips": 2.0}


@pytest.mark.parametrize(
    ("speed", "expected"), [(0.5, 0.5), (3.0, 1.0), (0.0, 0.0), (-0.5, -0.5), (-3.0, -1.0)]
)
def test_reward_grows_with_speed_backward_and_forward_costs(
    hopper: Any, speed: float, expected: float
) -> None:
    rewards, measures = judged(hopper, [{"rooty": -speed * STEP * k, "rootz": HIGH} for k in range(20)])
    assert rewards == pytest.approx([expected] * 19)
    assert measures["flips"] == (speed > 2)


@pytest.mark.parametrize(("off", "expected"), [(0.0, 0.1), (0.15, 0.55), (0.3, 1.0)])
def test_reward_grows_with_height(hopper: Any, off: float, expected: float) -> None:
    rewards, _ = judged(hopper, [{"rooty": -STEP * k, "rootz": off - 0.06} for k in range(2)])
    assert rewards == pytest.approx([expected], abs=0.05)  # the heel rises as the hopper leans back


def test_backward_is_away_from_the_nose(hopper: Any) -> None:
    states_of(hopper, [{}])
    hopper.restore(SEED, hopper.physics_state())
    place = hopper.scene.data.geom
    assert place("nose").xpos[0] > place("torso").xpos[0]
    states_of(hopper, [{"rooty": -TURN / 4, "rootz": HIGH}])
    hopper.restore(SEED, hopper.physics_state())
    assert place("torso").xpos[0] < place("calf").xpos[0]
    assert place("nose").xpos[2] > place("torso").xpos[2]  # it looks up


def test_forward_flips_are_none(hopper: Any) -> None:
    rewards, measures = judged(hopper, [{"rooty": STEP * k, "rootz": HIGH} for k in range(120)])
    assert rewards == pytest.approx([-1.0] * 119)
    assert measures == {"flips": 0.0}


def test_rolling_on_the_floor_is_worth_little_and_is_no_flip(hopper: Any) -> None:
    rewards, measures = judged(hopper, [lying(hopper, -STEP * k) for k in range(120)])
    assert rewards == pytest.approx([0.1] * 119)
    assert measures == {"flips": 0.0}


def test_rocking_on_the_floor_earns_nothing(hopper: Any) -> None:
    angles = [TURN / 6 * math.sin(TURN * k / 50) for k in range(201)]
    rewards, measures = judged(hopper, [lying(hopper, angle) for angle in angles])
    assert sum(rewards) == pytest.approx(0.0, abs=0.1)
    assert measures == {"flips": 0.0}


def test_a_turn_must_not_be_broken_by_lying_down(hopper: Any) -> None:
    flying = [{"rooty": -STEP * k, "rootz": HIGH} for k in range(90)]
    broken = [*flying[:45], lying(hopper, -STEP * 45), *flying[45:]]
    assert judged(hopper, flying)[1] == {"flips": 1.0}
    assert judged(hopper, broken)[1] == {"flips": 0.0}


def test_a_turn_goes_on_after_a_resume() -> None:
    first, second = (suite_environment(Behaviour(behaviour="hopper-backflip")) for _ in range(2))
    first.scene.data.qpos[:], first.scene.data.qvel[:] = 0.0, 0.0
    first.scene.data.qpos[1], first.scene.data.qvel[2] = 20.0, -TURN
    first.set_state(first.get_state())
    still = np.zeros(4, np.float32)
    for _ in range(40):
        first.step(still)
    second.set_state(first.get_state())
    for _ in range(20):
        assert first.step(still)[1:] == second.step(still)[1:]
    assert first.step(still)[4]["measures"]["flips"] == 1.0
