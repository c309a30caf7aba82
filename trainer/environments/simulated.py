"""Environments in MuJoCo: the simulator's whole state as one vector, and a scene to draw."""

from __future__ import annotations

import logging
from abc import abstractmethod
from typing import Any

import mujoco
import numpy as np

from trainer.environments.episodic import EpisodicEnvironment
from trainer.environments.interface import PhysicsState

INTEGRATION = mujoco.mjtState.mjSTATE_INTEGRATION


def tell_warnings() -> None:
    """Have MuJoCo's warnings in the log, not in a file wherever the process runs (MUJOCO_LOG.TXT)."""
    mujoco.set_mju_user_warning(logging.getLogger("mujoco").info)


class SimulatedEnvironment(EpisodicEnvironment):
    """An environment that is its own scene."""

    @property
    @abstractmethod
    def name(self) -> str:
        """What the camera depends on."""

    @property
    @abstractmethod
    def model(self) -> Any:
        """The simulator's `mujoco.MjModel`."""

    @property
    @abstractmethod
    def data(self) -> Any:
        """The simulator's `mujoco.MjData`."""

    @property
    def scene(self) -> SimulatedEnvironment:
        return self

    @property
    def state_size(self) -> int:
        return int(mujoco.mj_stateSize(self.model, INTEGRATION))

    def physics_state(self) -> PhysicsState:
        state = np.empty(self.state_size, np.float64)
        mujoco.mj_getState(self.model, self.data, state, INTEGRATION)
        return state

    def restore(self, episode_seed: int, state: PhysicsState) -> None:
        """Put the simulator into a state [S] of that episode; the episode cannot be stepped on from there."""
        if state.shape != (self.state_size,):
            size = self.state_size
            raise ValueError(f"state: shape {state.shape}, but a state of {self.name} has shape ({size},)")
        if episode_seed != self._seed:
            self._start(episode_seed)
        self._enter(state)
        self._ended = True

    def _enter(self, state: PhysicsState) -> None:
        """Set the simulator's state; set again after `mj_forward`, which may touch the warm start."""
        mujoco.mj_setState(self.model, self.data, state, INTEGRATION)
        mujoco.mj_forward(self.model, self.data)
        mujoco.mj_setState(self.model, self.data, state, INTEGRATION)
