"""The quadruped's wave: what is rewarded and counted, on motions driven through its actuators."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from labels_db.run_config import Behaviour
from tests.environments.motions import action_of, stand_up, suite_environment
from trainer.environments.behaviours import Measures
from trainer.environments.behaviours.strokes import Strokes

SIDES = [("left", "right"), ("right", "left")]
SETTLING = 50  # control steps of 0.02 s


def quadruped(side: str) -> Any:
    environment = suite_environment(Behaviour(behaviour=f"quadruped-wave-{side}-front"))
    stand_up(environment, 0.57)
    return environment


def leaning(leg: str) -> dict[str, float]:
    """Controls that put the weight on the three legs other than that front leg."""
    other, sign = ("right", 1) if leg == "left" else ("left", -1)
    return {
        f"yaw_front_{other}": 0.8 * sign,
        f"yaw_back_{leg}": -0.8 * sign,
        f"lift_front_{other}": 0.1,
        f"lift_back_{leg}": 0.1,
        f"lift_back_{other}": -0.1,
    }


def waving(leg: str, step: int, hertz: float, reach: float = 0.4) -> Mapping[str, float]:
    """Controls of a wave with that front leg, after settling on the other three."""
    if step < SETTLING:
        return leaning(leg)
    angle = 2 * math.pi * hertz * 0.02 * (step - SETTLING)
    return {**leaning(leg), f"lift_front_{leg}": -0.55 + reach * math.sin(angle)}


def waved(environment: Any, leg: str, hertz: float, reach: float = 0.4) -> tuple[float, Measures]:
    """Mean reward after settling, and measures, of six seconds."""
    rewards = []
    for step in range(300):
        _, reward, *_, info = environment.step(action_of(environment, waving(leg, step, hertz, reach)))
        rewards.append(reward)
    return float(np.mean(rewards[2 * SETTLING :])), info["measures"]


@pytest.mark.parametrize(("side", "other"), SIDES)
def test_waving_the_wished_leg_is_worth_most(side: str, other: str) -> None:
    reward, measures = waved(quadruped(side), side, hertz=1.5)
    assert reward > 0.5
    assert measures["waves"] == pytest.approx(
        7, abs=1
    )  # five seconds, the first stroke while the foot comes up
    assert measures["standing"] == 1.0
    reward, measures = waved(quadruped(side), other, hertz=1.5)
    assert reward == pytest.approx(0.2, abs=0.01)
    assert measures["waves"] == 0


def test_a_tremble_is_no_wave() -> None:
    """A policy that was paid for its toe's speed trembled by two centimetres, twelve times a second."""
    wave, _ = waved(quadruped("left"), "left", hertz=1.5)
    for hertz, reach in ((4, 0.4), (6, 0.2), (12, 0.4)):
        tremble, measures = waved(quadruped("left"), "left", hertz, reach)
        assert tremble < 0.5 * wave
        assert measures["waves"] == 0


def test_left_is_the_robots_own() -> None:
    """+y lies to the left of +x, where its eyes look."""
    environment = quadruped("left")
    place = environment.scene.data.geom
    assert place("eye_l").xpos[0] > 0
    assert place("toe_front_left").xpos[0] > 0
    assert place("toe_front_left").xpos[1] > 0 > place("toe_front_right").xpos[1]


def test_standing_and_holding_a_foot_up_are_worth_little() -> None:
    environment = quadruped("left")
    rewards = [environment.step(action_of(environment, {}))[1] for _ in range(100)]
    assert max(rewards) < 0.25
    assert waved(quadruped("left"), "left", hertz=0.0)[0] < 0.3


def test_trembling_is_worth_less_than_waving() -> None:
    calm, measures = waved(quadruped("left"), "left", hertz=1.5)
    trembling, none = waved(quadruped("left"), "left", hertz=8.0)
    assert trembling < 0.6 * calm
    assert measures["waves"] > none["waves"] == 0


def test_a_fallen_robot_earns_next_to_nothing_whatever_it_waves() -> None:
    environment = quadruped("left")
    environment.scene.data.qpos[2:7] = 0.5, 0.0, 1.0, 0.0, 0.0  # on its back
    environment.set_state(environment.get_state())
    reward, measures = waved(environment, "left", hertz=1.5)
    assert reward < 0.05
    assert measures == {"waves": 0.0, "standing": 0.0}


def test_strokes_go_on_after_a_resume() -> None:
    first, second = quadruped("left"), suite_environment(Behaviour(behaviour="quadruped-wave-left-front"))
    for step in range(130):
        first.step(action_of(first, waving("left", step, 1.5)))
    second.set_state(first.get_state())
    for step in range(130, 180):
        action = action_of(first, waving("left", step, 1.5))
        assert first.step(action)[1:] == second.step(action)[1:]


@pytest.mark.parametrize(
    ("heights", "count"),
    [
        ([0.0, 0.1, 0.0], 1),
        ([0.0, 0.05, 0.1, 0.05, 0.0, 0.1, 0.0], 2),
        ([0.0, 0.09, 0.0, 0.09, 0.0], 0),
        ([0.3, 0.0, 0.3], 0),
        ([0.3, 0.0, 0.3, 0.25, 0.35, 0.2], 1),
        ([0.0, 0.2, 0.4, 0.6], 0),
    ],
)
def test_a_stroke_goes_up_and_down_by_a_tenth_of_a_metre(heights: list[float], count: int) -> None:
    strokes = Strokes()
    for height in heights:
        strokes.follow(height)
    assert strokes.count == count


def test_a_broken_stroke_does_not_count() -> None:
    strokes = Strokes()
    for height in (0.0, 0.2):
        strokes.follow(height)
    strokes.break_off()
    strokes.follow(0.0)
    assert strokes.count == 0
