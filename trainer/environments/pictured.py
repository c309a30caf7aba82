"""Scenes of environments that draw themselves."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from trainer.environments.gym_numbers import Numbers
from trainer.environments.gym_task import make
from trainer.environments.interface import PhysicsState


class PictureScene:
    """A copy of an environment, only to be drawn: numbers go in, a picture comes out."""

    model = data = None

    def __init__(self, id: str, numbers: Numbers) -> None:
        self.name, self._numbers = id, numbers
        env = make(id, render_mode="rgb_array")
        env.reset(seed=0)
        self._env: Any = env.unwrapped

    def restore(self, episode_seed: int, state: PhysicsState) -> None:
        """Give it a state [S]; all that differs between episodes is in there."""
        if state.shape != (self._numbers.size,):
            size = self._numbers.size
            raise ValueError(f"state: shape {state.shape}, but a state of {self.name} has shape ({size},)")
        self._numbers.write(self._env, state)

    def picture(self) -> npt.NDArray[np.uint8]:
        """What it looks like, in its own size [height, width, 3]."""
        return np.asarray(self._env.render(), np.uint8)
