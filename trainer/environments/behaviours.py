"""Behaviours: a person's wish, put as a reward over the simulator, for scripted teachers."""

from __future__ import annotations

import math
from dataclasses import dataclass
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


@dataclass
class Windmill:
    """Cart pole: the pole keeps turning one way, the faster the better up to `fastest`.

    Seen from the front a positive hinge velocity is clockwise. The reward is ω / `fastest`, held
    between 0 and 1; `turns` counts how far the hinge has turned, in full turns.
    """

    sign: int
    fastest: float = 8 * math.pi  # rad/s; four turns a second, which the cart's motor cannot keep up for long
    _start: float = 0.0

    def begin(self, physics: Any) -> None:
        self._start = self._angle(physics)

    def reward(self, physics: Any) -> float:
        velocity = self.sign * float(physics.named.data.qvel["hinge_1"][0])
        return min(max(velocity / self.fastest, 0.0), 1.0)

    def measures(self, physics: Any) -> Measures:
        return {"turns": self.sign * (self._angle(physics) - self._start) / (2 * math.pi)}

    def _angle(self, physics: Any) -> float:
        return float(physics.named.data.qpos["hinge_1"][0])


@dataclass(frozen=True)
class Behaviour:
    """A wish over one task's simulator and start, and how it is put to people."""

    title: str
    goal: str
    task: str
    sign: int

    def wish(self) -> Wish:
        """The wish, new: it keeps where its episode started."""
        return Windmill(self.sign)


BEHAVIOURS = MappingProxyType(
    {
        "cartpole-windmill-clockwise": Behaviour(
            title="Cart pole · clockwise windmill",
            goal="Prefer the clip in which the pole turns clockwise, faster and more evenly.",
            task="cartpole-swingup",
            sign=1,
        ),
        "cartpole-windmill-counter-clockwise": Behaviour(
            title="Cart pole · counter-clockwise windmill",
            goal="Prefer the clip in which the pole turns counter-clockwise, faster and more evenly.",
            task="cartpole-swingup",
            sign=-1,
        ),
    }
)
