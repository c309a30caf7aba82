"""Hopper: a backflip."""

from __future__ import annotations

import math
from typing import Any

from trainer.environments.behaviours.shapes import clearances, ramp
from trainer.environments.behaviours.wish import Measures, Memory

BODY = ("torso", "nose", "pelvis", "thigh", "calf")
TOUCHING = 0.005  # metres: the simulator's contacts are soft
TURN = 2 * math.pi


class Backflip:
    """The hopper turns backward, head over heels, in the air.

    Its nose points along +x and the root's hinge turns about +y, so that backward is the negative way:
    counter-clockwise in the clip. The reward of a control step is its backward velocity over `fastest`, held between
    -1 and 1, times `rolling` on the floor, growing to 1 where the lowest part is `high` above it. Forward costs what
    backward gains, so that rocking to and fro on the floor earns nothing, and rolling little.
    `flips` counts full turns of the torso during which nothing but the foot touched the floor.
    """

    fastest = TURN  # rad/s
    high = 0.3  # metres
    rolling = 0.1

    def begin(self, physics: Any) -> None:
        self._angle, self._turned, self._flips = self._backward(physics), 0.0, 0

    def reward(self, physics: Any) -> float:
        *body, foot = clearances(physics, (*BODY, "foot"))
        self._watch(physics, lying=min(body) < TOUCHING)
        flying = self.rolling + (1 - self.rolling) * ramp(min(*body, foot), 0.0, self.high)
        velocity = -float(physics.named.data.qvel["rooty"][0])
        return min(max(velocity / self.fastest, -1.0), 1.0) * flying

    def measures(self, physics: Any) -> Measures:
        del physics
        return {"flips": float(self._flips)}

    def state(self) -> Memory:
        return {"angle": self._angle, "turned": self._turned, "flips": self._flips}

    def load(self, memory: Memory) -> None:
        self._angle, self._turned, self._flips = memory["angle"], memory["turned"], memory["flips"]

    def _watch(self, physics: Any, *, lying: bool) -> None:
        """Go on with the turn, or begin anew where the body lies on the floor."""
        angle = self._backward(physics)
        self._turned = 0.0 if lying else self._turned + angle - self._angle
        self._angle = angle
        if self._turned >= TURN:
            self._flips, self._turned = self._flips + 1, self._turned - TURN

    def _backward(self, physics: Any) -> float:
        """The torso's angle, rad, growing as it turns backward."""
        return -float(physics.named.data.qpos["rooty"][0])
