"""Walker: walking with both legs."""

from __future__ import annotations

from typing import Any

from trainer.environments.behaviours.shapes import ramp
from trainer.environments.behaviours.turns import TakingTurns
from trainer.environments.behaviours.wish import Measures, Memory


class BothLegs:
    """The walker walks to the right, upright, and its feet take turns.

    The reward of a control step is `still` × standing + up × moving × (`shuffle` + the rest × turns): standing, how far
    the torso is upright and up to 1.2 m; up, how far its height has come from 0.7 to 1.1 m; moving, the speed forward
    up to 1 m/s; turns, how well the feet take turns. Who sits gets nothing for hopping about: first it is to stand,
    then to walk.
    """

    still, shuffle = 0.15, 0.15

    def __init__(self) -> None:
        self._turns = TakingTurns()

    def begin(self, physics: Any) -> None:
        self._turns.begin(physics)

    def reward(self, physics: Any) -> float:
        turns = self._turns.watch(physics)
        height, upright = ramp(physics.torso_height(), 0.2, 1.2), (1 + float(physics.torso_upright())) / 2
        standing = (3 * height + upright) / 4
        moving = ramp(physics.horizontal_velocity(), 0.0, 1.0)
        up, rest = ramp(physics.torso_height(), 0.7, 1.1), 1 - self.still - self.shuffle
        return self.still * standing + up * moving * (self.shuffle + rest * turns)

    def measures(self, physics: Any) -> Measures:
        del physics
        return self._turns.measures()

    def state(self) -> Memory:
        return self._turns.state()

    def load(self, memory: Memory) -> None:
        self._turns.load(memory)
