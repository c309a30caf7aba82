"""Any environment registered with Gymnasium that takes continuous actions.

Import through `make_environment`, which keeps OpenGL out of the process.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from trainer.environments.episodic import Control, EpisodicEnvironment
from trainer.environments.gym_numbers import Numbers
from trainer.environments.gym_task import GymTask
from trainer.environments.interface import Environment, EnvironmentState, Observation, PhysicsState
from trainer.environments.json_state import array_from_json, array_to_json
from trainer.environments.pictured import PictureScene
from trainer.environments.simulated import SimulatedEnvironment, tell_warnings


def registered(id: str, action_repeat: int) -> Environment:
    """The environment of that id, drawn by the renderer if it is MuJoCo's, else by itself."""
    tell_warnings()
    task = GymTask(id)
    simulated = isinstance(getattr(task.unwrapped, "model", None), mujoco.MjModel)
    return (SimulatedGym if simulated else PicturedGym)(task, action_repeat)


class GymEnvironment(EpisodicEnvironment):
    """Goes to a state by living its episode again, from its seed through the same controls.

    The simulator's state alone would not do: Ant's and Humanoid's rewards, for one, compare with where bodies
    were left by the step before, and what an environment keeps in Python is known to nobody else.
    """

    def __init__(self, task: GymTask, action_repeat: int) -> None:
        self._task = task
        self.control_step, self.episode_steps = task.control_step, task.episode_steps
        self._controls: list[Control] = []
        self._make_ready(task.action_size, action_repeat)

    @property
    def name(self) -> str:
        return self._task.id

    def _begin(self, seed: int) -> None:
        self._controls = []
        self._seen = self._task.begin(seed)

    def _control_step(self, control: Control) -> tuple[float, bool, bool]:
        self._controls.append(control)
        self._seen, reward, terminated, truncated = self._task.step(control)
        return reward, terminated, truncated

    def _observe(self) -> Observation:
        return self._seen

    def _measures(self) -> dict[str, float]:
        return {"seconds": round(self._step * self.control_step, 9)}

    def _beside_physics(self) -> dict[str, dict[str, Any]]:
        return {"random": {}, "task": {"controls": array_to_json(np.ravel(self._controls))}}

    def _go_to(self, state: EnvironmentState) -> None:
        lived = array_from_json(state.task["controls"])
        for control in lived.reshape(-1, self._task.action_size):
            self._control_step(control)


class SimulatedGym(GymEnvironment, SimulatedEnvironment):
    """In MuJoCo: the renderer draws its simulator."""

    @property
    def model(self) -> Any:
        return self._task.unwrapped.model

    @property
    def data(self) -> Any:
        return self._task.unwrapped.data


class PicturedGym(GymEnvironment):
    """Written in Python: it is drawn by itself, from its numbers; one that has others too cannot be drawn."""

    def __init__(self, task: GymTask, action_repeat: int) -> None:
        task.begin(0)
        task.step(np.zeros(task.action_size))  # some numbers are there only after a step
        self._numbers = Numbers(task.unwrapped)
        super().__init__(task, action_repeat)

    @property
    def state_size(self) -> int:
        return self._numbers.size

    def physics_state(self) -> PhysicsState:
        return self._numbers.of(self._task.unwrapped)

    @property
    def scene(self) -> PictureScene:
        if not self.state_size:
            raise ValueError(
                f"gym:{self.name}: cannot be drawn again from a state, so clips of it cannot be made"
            )
        return PictureScene(self.name, self._numbers)
