"""Tasks of Meta-world (v3): a robot arm with a gripper, moved by where its hand should go.

Import through `make_environment`, which keeps OpenGL out of the process and says what to install.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from metaworld.env_dict import ALL_V3_ENVIRONMENTS

from trainer.environments.episodic import Control
from trainer.environments.interface import EnvironmentState, Observation, PhysicsState
from trainer.environments.json_state import array_from_json, array_to_json
from trainer.environments.simulated import SimulatedEnvironment, tell_warnings

VERSION = "-v3"
AWAY = 10.0  # metres: where Meta-world keeps the mark of a goal that is not this task's
# What a start decides comes back with its seed; these numbers change from step to step (the second: bin-picking).
COUNTERS = ("curr_path_length", "_target_to_obj_init")


class MetaWorldEnvironment(SimulatedEnvironment):
    """A task named as in `drawer-close`: 500 steps, start and goal drawn anew by every episode's seed."""

    def __init__(self, task: str, action_repeat: int, *, goal_visible: bool) -> None:
        self._env, self._task = build(task, goal_visible=goal_visible), task
        self.control_step = float(self._env.dt)
        self.episode_steps = int(self._env.max_path_length)
        self._success = 0.0
        self._make_ready(self._env.action_space.shape[0], action_repeat)

    @property
    def name(self) -> str:
        return f"metaworld-{self._task}"

    @property
    def model(self) -> Any:
        return self._env.model

    @property
    def data(self) -> Any:
        return self._env.data

    def restore(self, episode_seed: int, state: PhysicsState) -> None:
        super().restore(episode_seed, state)
        # Many tasks keep the goal beside the model, or in a body's own frame: its mark is put there for drawing.
        for mark, place in self._env._target_site_config:
            away = np.max(place) >= AWAY
            self._env._set_pos_site(mark, place if away else self._env._target_pos)

    def _begin(self, seed: int) -> None:
        self._env.seed(seed)
        self._seen, _ = self._env.reset()
        self._success = 0.0

    def _control_step(self, control: Control) -> tuple[float, bool, bool]:
        self._seen, reward, terminated, truncated, info = self._env.step(control)
        self._success = max(self._success, float(info["success"]))
        return float(reward), terminated, truncated

    def _observe(self) -> Observation:
        return np.asarray(self._seen, np.float32)

    def _measures(self) -> dict[str, float]:
        return {"success": self._success}

    def _beside_physics(self) -> dict[str, dict[str, Any]]:
        task = {
            "success": self._success,
            "previous": array_to_json(self._env._prev_obs),
            "counters": {name: getattr(self._env, name, None) for name in COUNTERS},
        }
        return {"random": self._env.np_random.bit_generator.state, "task": task}

    def _go_to(self, state: EnvironmentState) -> None:
        self._enter(state.physics)
        self._env.np_random.bit_generator.state = state.random
        self._success = state.task["success"]
        self._env._prev_obs = array_from_json(state.task["previous"])
        for name, value in state.task["counters"].items():
            setattr(self._env, name, value)


def build(task: str, *, goal_visible: bool) -> Any:
    """Meta-world's environment of a task, which draws start and goal at every reset from its own generator."""
    if task + VERSION not in ALL_V3_ENVIRONMENTS:
        known = ", ".join(name.removesuffix(VERSION) for name in ALL_V3_ENVIRONMENTS)
        raise ValueError(f"metaworld:{task}: unknown task; one of {known}")
    tell_warnings()
    env: Any = ALL_V3_ENVIRONMENTS[task + VERSION](reward_function_version="v2")
    env._freeze_rand_vec, env.seeded_rand_vec, env._set_task_called = False, True, True
    env._partially_observable = not goal_visible
    # Observations are clipped to this space, which was made for a hidden goal: it is made anew.
    del env.sawyer_observation_space
    return env
