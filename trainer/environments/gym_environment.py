"""Any environment registered with Gymnasium that takes continuous actions.

Import through `make_environment`, which keeps OpenGL out of the process.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from trainer.environments.episodic import Control, EpisodicEnvironment
from trainer.environments.filmed import STATE_SIZE, FilmScene, kept
from trainer.environments.gym_numbers import Numbers
from trainer.environments.gym_task import GymTask
from trainer.environments.interface import Environment, EnvironmentState, Observation, PhysicsState
from trainer.environments.json_state import array_from_json, array_to_json
from trainer.environments.pictured import PictureScene
from trainer.environments.simulated import SimulatedEnvironment, tell_warnings


def registered(id: str, action_repeat: int) -> Environment:
    """The environment of that id, drawn by the renderer if it is MuJoCo's, else as it can be."""
    tell_warnings()
    task = GymTask(id)
    if isinstance(getattr(task.unwrapped, "model", None), mujoco.MjModel):
        return SimulatedGym(task, action_repeat)
    if "rgb_array" not in task.unwrapped.metadata.get("render_modes", ()):
        return UnseenGym(task, action_repeat)
    numbers = _numbers_of(task)
    return PicturedGym(task, action_repeat, numbers) if numbers else FilmedGym(task, action_repeat)


def _numbers_of(task: GymTask) -> Numbers | None:
    """What it keeps, if that is nothing but numbers; some are there only after a step."""
    task.begin(0)
    task.step(np.zeros(task.action_size))
    numbers = Numbers(task.unwrapped)
    return numbers if numbers.are_all_there_is else None


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
    """Written in Python, and nothing but numbers: it is drawn by itself, from its numbers."""

    def __init__(self, task: GymTask, action_repeat: int, numbers: Numbers) -> None:
        self._numbers = numbers
        super().__init__(task, action_repeat)

    @property
    def state_size(self) -> int:
        return self._numbers.size

    def physics_state(self) -> PhysicsState:
        return self._numbers.of(self._task.unwrapped)

    @property
    def scene(self) -> PictureScene:
        return PictureScene(self.name, self._numbers)


class FilmedGym(GymEnvironment):
    """Keeps more than numbers, as Box2D does: each moment is drawn when it is there, and the picture is kept.

    Drawn once a control step, also where an episode is lived again: some change by being drawn, as the lunar
    lander's sparks fade. And made anew for every episode: a world of Box2D remembers the one before.
    """

    @property
    def state_size(self) -> int:
        return STATE_SIZE

    def _begin(self, seed: int) -> None:
        self._task.close()
        self._task = GymTask(self._task.id, render_mode="rgb_array")
        super()._begin(seed)
        self._picture = self._task.picture()

    def _control_step(self, control: Control) -> tuple[float, bool, bool]:
        outcome = super()._control_step(control)
        self._picture = self._task.picture()
        return outcome

    def physics_state(self) -> PhysicsState:
        return kept(self._picture)

    @property
    def scene(self) -> FilmScene:
        return FilmScene(self.name, self.physics_state())


class UnseenGym(GymEnvironment):
    """Draws no pictures: only scripted teachers can be asked about it."""

    @property
    def state_size(self) -> int:
        return 0

    def physics_state(self) -> PhysicsState:
        return np.empty(0)

    @property
    def scene(self) -> PictureScene:
        raise ValueError(f"gym:{self.name}: draws no pictures, so clips of it cannot be made")
