"""What every environment is: gymnasium's API, plus an exact state and a scene that can be drawn."""

from __future__ import annotations

import json
from abc import abstractmethod
from dataclasses import dataclass, field
from typing import Any, Protocol

import gymnasium
import numpy as np
import numpy.typing as npt

from trainer.environments.json_state import array_from_json, array_to_json

Observation = npt.NDArray[np.float32]
Action = npt.NDArray[np.float32]
PhysicsState = npt.NDArray[np.float64]


@dataclass(frozen=True)
class EnvironmentState:
    """All that an episode needs to go on exactly: the simulator's state [S] and what lies around it.

    `random` holds generators, `wish` what the reward remembers, `task` what else is kept between steps.
    """

    episode_seed: int
    step: int
    ended: bool
    physics: PhysicsState
    observation: Observation
    random: dict[str, Any] = field(default_factory=dict)
    wish: dict[str, Any] = field(default_factory=dict)
    task: dict[str, Any] = field(default_factory=dict)

    def to_json(self) -> str:
        """This state as JSON that gives back every bit."""
        arrays = {name: array_to_json(getattr(self, name)) for name in ("physics", "observation")}
        return json.dumps({**vars(self), **arrays})

    @classmethod
    def from_json(cls, text: str) -> EnvironmentState:
        """The state that `to_json` wrote."""
        values = json.loads(text)
        arrays = {name: array_from_json(values[name]) for name in ("physics", "observation")}
        return cls(**{**values, **arrays})


class Scene(Protocol):
    """What a renderer draws: a simulator that goes to any state of any episode."""

    @property
    def name(self) -> str:
        """Robot and task, as in `walker-walk`; the camera depends on it."""

    @property
    def model(self) -> Any:
        """The simulator's `mujoco.MjModel`; None for one that has its own pictures."""

    @property
    def data(self) -> Any:
        """The simulator's `mujoco.MjData`."""

    def restore(self, episode_seed: int, state: PhysicsState) -> None:
        """Put the simulator into a state [S] of the episode with that seed."""


class Environment(gymnasium.Env[Observation, Action]):
    """A robot and a task: observations are flat float32 [D], actions lie in [-1, 1]^A."""

    control_step: float
    """Simulated seconds in one control step; a step of the agent is `action_repeat` of them."""

    episode_steps: int
    """Control steps of a whole episode."""

    moments: PhysicsState
    """States [action_repeat, S] at which the last step's control steps began: what there is to draw of it."""

    @abstractmethod
    def step(self, action: Action) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """gymnasium's step; `info["measures"]` maps names to numbers that people understand."""

    @property
    @abstractmethod
    def state_size(self) -> int:
        """S, the length of `physics_state()`."""

    @property
    @abstractmethod
    def scene(self) -> Scene:
        """This very simulator, to be drawn."""

    @abstractmethod
    def physics_state(self) -> PhysicsState:
        """The simulator's state [S], enough to draw this moment again; cheap."""

    @abstractmethod
    def get_state(self) -> EnvironmentState:
        """The state from which `set_state` goes on bit by bit."""

    @abstractmethod
    def set_state(self, state: EnvironmentState) -> Observation:
        """Go to that state and return its observation [D]."""
