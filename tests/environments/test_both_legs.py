"""The walker's legs taking turns: what is rewarded and measured, on gaits made by hand."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from labels_db.run_config import Behaviour, DMControl
from tests.environments.given import actions
from tests.environments.motions import SEED, Pose, judge, states_of, suite_environment
from trainer.environments.behaviours import Measures
from trainer.environments.behaviours.shapes import clearances

FEET = ("right_foot", "left_foot")
ROOT_HEIGHT = 1  # in a state of the simulator, which begins with the time, then the positions
Gait = Callable[[float], tuple[dict[str, float], str]]
"""Phase in cycles → angles of hips and knees (rad), and the foot that stands on the floor."""


def walk(phase: float) -> tuple[dict[str, float], str]:
    """The legs swing past each other; the one that comes forward bends its knee."""
    angle, forward = 0.3 * math.sin(math.tau * phase), math.cos(math.tau * phase)
    lifted = ("left", "right")[forward > 0]
    bend = {f"{lifted}_knee": -1.2 * abs(forward)}
    stands = ("right", "left")[forward > 0]
    return {"right_hip": angle, "left_hip": -angle, **bend}, stands


def shuffle(phase: float) -> tuple[dict[str, float], str]:
    """The right leg always leads; the left one is drawn up behind it."""
    opening = 0.15 + 0.1 * math.sin(math.tau * phase)
    stands = ("right", "left")[math.cos(math.tau * phase) > 0]
    return {"right_hip": opening, "left_hip": -opening}, stands


def hop(phase: float) -> tuple[dict[str, float], str]:
    """All on the right leg; the left one swings to and fro in the air."""
    angle = 0.3 * math.sin(math.tau * phase)
    return {"left_hip": angle, "right_hip": -angle, "left_knee": -1.2}, "right"


def stand(phase: float) -> tuple[dict[str, float], str]:
    del phase
    return {}, "right"


@pytest.fixture(scope="module")
def walker() -> Any:
    return suite_environment(Behaviour(behaviour="walker-walk-both-legs"))


def lived(walker: Any, gait: Gait, *, speed: float = 1.0, hertz: float = 1.0, seconds: float = 8.0) -> Any:
    """The states [L, S] of a gait at a speed, m/s, upright and with the standing foot on the floor."""
    poses: list[Pose] = []
    for step in range(round(seconds / walker.control_step)):
        time = step * walker.control_step
        pose, stands = gait(hertz * time)
        pose = {**flat_feet(pose), "rootx": speed * time}
        states_of(walker, [pose])
        walker.restore(SEED, walker.physics_state())
        off = clearances(walker._physics, FEET)[FEET.index(f"{stands}_foot")]
        poses.append({**pose, "rootz": -float(off)})
    return states_of(walker, poses)


def flat_feet(pose: dict[str, float]) -> dict[str, float]:
    """The pose with ankles that keep the soles level."""
    ankles = {
        f"{side}_ankle": -pose.get(f"{side}_hip", 0.0) - pose.get(f"{side}_knee", 0.0)
        for side in ("right", "left")
    }
    return {**pose, **ankles}


def judged(walker: Any, gait: Gait, **how: float) -> tuple[float, Measures]:
    """Mean reward after the first two seconds, and measures."""
    rewards, measures = judge(walker, lived(walker, gait, **how))
    return float(np.mean(rewards[80:])), measures


def test_walking_with_both_legs_is_worth_nearly_everything(walker: Any) -> None:
    reward, measures = judged(walker, walk)
    assert reward > 0.9
    assert measures["alternation"] > 0.85  # the first lead can only be taken, not changed


@pytest.mark.parametrize("gait", [shuffle, hop])
def test_one_leg_ahead_is_worth_little(walker: Any, gait: Gait) -> None:
    reward, measures = judged(walker, gait)
    assert reward == pytest.approx(0.3, abs=0.02)
    assert measures["alternation"] == 0.0


def test_standing_is_worth_little(walker: Any) -> None:
    reward, measures = judged(walker, stand, speed=0.0)
    assert reward == pytest.approx(0.15, abs=0.01)
    assert measures["alternation"] == 0.0


@pytest.mark.parametrize(("speed", "expected"), [(-1.0, 0.15), (0.5, 0.55)])
def test_the_same_gait_is_worth_less_when_slow(walker: Any, speed: float, expected: float) -> None:
    assert judged(walker, walk, speed=speed)[0] == pytest.approx(expected, abs=0.06)


def test_slow_turns_count_less_and_rare_ones_not(walker: Any) -> None:
    found = [judged(walker, walk, hertz=hertz)[1]["alternation"] for hertz in (1.0, 0.55, 0.2)]
    assert found[0] > found[1] > found[2]
    assert found[2] < 0.4


def test_legs_kicked_while_lying_do_not_count(walker: Any) -> None:
    states = lived(walker, walk)
    states[:, ROOT_HEIGHT] -= 1.0
    rewards, measures = judge(walker, states)
    assert measures["alternation"] == 0.0
    assert max(rewards) < 0.2


@pytest.mark.parametrize(("down", "moving"), [(0.65, 0.0), (0.4, 0.075), (0.1, 0.15)])
def test_who_sits_gains_nothing_by_moving(walker: Any, down: float, moving: float) -> None:
    """Answers about sitting walkers are about who sits higher, not about who hops; half way up, half of it counts."""
    rewards = []
    for speed in (0.0, 1.0):
        states = lived(walker, stand, speed=speed)
        states[:, ROOT_HEIGHT] -= down  # of a torso at 1.3 m
        rewards.append(np.mean(judge(walker, states)[0]))
    assert rewards[1] - rewards[0] == pytest.approx(moving, abs=0.002)


def test_the_suites_own_task_is_measured_alike() -> None:
    """Live, and afterwards from every second stored state."""
    walker = suite_environment(DMControl(task="walker-walk"))
    states, rewards = [walker.physics_state()], []
    for action in actions(walker, 200):
        _, reward, *_, info = walker.step(action)
        states.append(walker.physics_state())
        rewards.append(reward)
    again, measures = judge(walker, np.array(states))
    assert measures == info["measures"]
    assert again == pytest.approx(rewards)
    plain = suite_environment(DMControl(task="walker-walk"))
    gait = lived(plain, walk)
    whole, half = judge(plain, gait)[1], judge(plain, gait[::2])[1]
    assert whole["alternation"] == pytest.approx(half["alternation"], abs=0.05)
    assert whole["alternation"] > 0.85


def test_turns_go_on_after_a_resume(walker: Any) -> None:
    """In the middle of a walk: what was seen before counts on."""
    del walker
    config = Behaviour(behaviour="walker-walk-both-legs")
    first, second = suite_environment(config), suite_environment(config)
    judge(first, lived(first, walk))
    state = first.get_state()
    second.set_state(state)
    assert second.get_state().wish == state.wish
    assert state.wish["total"] > 200
    assert second._measures() == first._measures()
