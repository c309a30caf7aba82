"""Behaviours: a person's wish, put as a reward over the simulator, for scripted teachers."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any, Protocol

Measures = dict[str, float]


class Wish(Protocol):
    """What is asked of the robot: a true reward per control step, and measures that people understand."""

    def begin(self, physics: Any) -> None:
        """An episode starts in this state of the simulator."""

    def reward(self, physics: Any) -> float:
        """The true reward of the control step that just ended."""

    def measures(self, physics: Any) -> Measures:
        """What has been reached so far in the episode."""


class Windmill:
    """Cart pole: the pole keeps turning one way, the faster the better up to `fastest`.

    Seen from the front a positive hinge velocity is clockwise. The reward is ω / `fastest`, held
    between 0 and 1; `turns` counts how far the hinge has turned, in full turns.
    """

    fastest = 8 * math.pi  # rad/s: four turns a second, about the most that the cart's motor keeps up

    def __init__(self, sign: int) -> None:
        self._sign, self._start = sign, 0.0

    def begin(self, physics: Any) -> None:
        self._start = self._angle(physics)

    def reward(self, physics: Any) -> float:
        velocity = self._sign * float(physics.named.data.qvel["hinge_1"][0])
        return min(max(velocity / self.fastest, 0.0), 1.0)

    def measures(self, physics: Any) -> Measures:
        return {"turns": self._sign * (self._angle(physics) - self._start) / (2 * math.pi)}

    def _angle(self, physics: Any) -> float:
        return float(physics.named.data.qpos["hinge_1"][0])


@dataclass(frozen=True)
class BehaviourSpec:
    """A wish over one task's simulator and start, and how it is put to people."""

    title: str
    goal: str
    task: str
    make_wish: Callable[[], Wish]


BEHAVIOURS = MappingProxyType(
    {
        "cartpole-windmill-clockwise": BehaviourSpec(
            title="Cart pole · clockwise windmill",
            goal="Prefer the clip in which the pole turns clockwise, faster and more evenly.",
            task="cartpole-swingup",
            make_wish=partial(Windmill, sign=1),
        ),
        "cartpole-windmill-counter-clockwise": BehaviourSpec(
            title="Cart pole · counter-clockwise windmill",
            goal="Prefer the clip in which the pole turns counter-clockwise, faster and more evenly.",
            task="cartpole-swingup",
            make_wish=partial(Windmill, sign=-1),
        ),
    }
)
