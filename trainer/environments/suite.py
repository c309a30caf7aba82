"""Tasks of the dm_control suite, with their own reward or with a behaviour's.

Import through `make_environment`, which keeps OpenGL out of the process.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from dm_control.rl.control import PhysicsError

from trainer.environments.behaviours import Start, Wish, as_the_task_starts
from trainer.environments.episodic import Control
from trainer.environments.interface import EnvironmentState, Observation
from trainer.environments.json_state import random_from_json, random_to_json, seed_random
from trainer.environments.simulated import SimulatedEnvironment
from trainer.environments.suite_task import (
    TaskReward,
    action_range,
    build,
    gauge_of,
    headless,
    steps_of_episode,
)


class SuiteEnvironment(SimulatedEnvironment):
    """A task named as in `ball_in_cup-catch`; `wish` replaces its reward, `start` changes where it starts."""

    def __init__(
        self, name: str, action_repeat: int, wish: Wish | None = None, start: Start = as_the_task_starts
    ) -> None:
        built = build(name)
        self._task, self._physics = built.task, headless(built.physics)
        self._wish, self._arrange = wish or TaskReward(self._task, gauge_of(name)), start
        self._name = name
        self.control_step = float(built.control_timestep())
        self.episode_steps = steps_of_episode(built)
        self._substeps = round(self.control_step / self._physics.timestep())
        self._centre, self._reach = action_range(built.action_spec())
        self._make_ready(self._centre.size, action_repeat)

    @property
    def name(self) -> str:
        return self._name

    @property
    def model(self) -> Any:
        return self._physics.model.ptr

    @property
    def data(self) -> Any:
        return self._physics.data.ptr

    def _begin(self, seed: int) -> None:
        self._diverged = False
        seed_random(self._task.random, seed)
        with self._physics.reset_context():
            self._task.initialize_episode(self._physics)
            self._arrange(self._physics)
        self._wish.begin(self._physics)

    def _control_step(self, control: Control) -> tuple[float, bool, bool]:
        self._task.before_step(self._centre + self._reach * control, self._physics)
        try:
            self._physics.step(self._substeps)
        except PhysicsError:
            self._diverged = True
            return 0.0, False, True
        self._task.after_step(self._physics)
        return self._wish.reward(self._physics), *self._ending()

    def _ending(self) -> tuple[bool, bool]:
        """(terminated, truncated): only the discount 0 says that nothing follows."""
        discount = self._task.get_termination(self._physics)
        return discount == 0, discount is not None and discount != 0

    def _observe(self) -> Observation:
        if self._diverged:  # the episode is cut off before the nonsense is seen
            return self._observation
        parts = self._task.get_observation(self._physics).values()
        return np.concatenate([np.ravel(part) for part in parts]).astype(np.float32)

    def _measures(self) -> dict[str, float]:
        return self._wish.measures(self._physics)

    def _beside_physics(self) -> dict[str, dict[str, Any]]:
        return {"random": random_to_json(self._task.random), "wish": self._wish.state()}

    def _go_to(self, state: EnvironmentState) -> None:
        self._enter(state.physics)
        random_from_json(self._task.random, state.random)
        self._wish.load(state.wish)
