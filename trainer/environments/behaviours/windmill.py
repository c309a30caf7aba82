"""Cart pole: the pole turns like a windmill."""

from __future__ import annotations

import math
from typing import Any

from trainer.environments.behaviours.wish import Measures, Stateless


class Windmill(Stateless):
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
