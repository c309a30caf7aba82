"""What an environment written in Python is drawn from: the numbers among its attributes."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.envs.registration import EnvSpec

from trainer.environments.interface import PhysicsState

NUMBERS = (bool, int, float, np.number, np.bool_)
NO_STATE = (type(None), str, spaces.Space, EnvSpec, np.random.Generator)

SEED = "_np_random_seed"  # every environment has it, and none is drawn from it


def is_number(value: Any) -> bool:
    """A number, or an array of them."""
    return isinstance(value, NUMBERS) or (isinstance(value, np.ndarray) and value.dtype.kind in "biuf")


class Numbers:
    """Reads and writes an environment's numbers as one vector [S].

    A number that is not there yet (None) is NaN in the vector.
    """

    def __init__(self, env: Any) -> None:
        """`env` has been reset and stepped, so that every number is there."""
        attributes = {name: value for name, value in vars(env).items() if name != SEED}
        self._like = {name: value for name, value in attributes.items() if is_number(value)}
        self.size = sum(np.size(value) for value in self._like.values())
        plain = all(is_number(value) or isinstance(value, NO_STATE) for value in attributes.values())
        self.are_all_there_is = plain and self.size > 0
        """Whether a picture can depend on nothing else."""

    def of(self, env: Any) -> PhysicsState:
        """The environment's numbers now, [S]."""
        parts = [self._vector(getattr(env, name), np.size(like)) for name, like in self._like.items()]
        return np.concatenate(parts)

    def write(self, env: Any, state: PhysicsState) -> None:
        """Give the environment the numbers of a state [S]."""
        start = 0
        for name, like in self._like.items():
            part = state[start : start + np.size(like)]
            start += part.size
            setattr(env, name, None if np.isnan(part).all() else self._shaped(part, like))

    @staticmethod
    def _vector(value: Any, size: int) -> PhysicsState:
        return np.full(size, np.nan) if value is None else np.ravel(value).astype(np.float64)

    @staticmethod
    def _shaped(part: PhysicsState, like: Any) -> Any:
        return (
            part.reshape(like.shape).astype(like.dtype)
            if isinstance(like, np.ndarray)
            else type(like)(part[0])
        )
