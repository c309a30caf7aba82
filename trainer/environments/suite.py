"""Tasks of the dm_control suite, with their own reward or with a behaviour's.

Import through `make_environment`, which keeps OpenGL out of the process.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt
from dm_control.rl.control import PhysicsError
from gymnasium import spaces

from trainer.environments.behaviours import Wish
from trainer.environments.interface import (
    Action,
    Environment,
    EnvironmentState,
    Observation,
    PhysicsState,
)
from trainer.environments.json_state import random_from_json, random_to_json, seed_random
from trainer.environments.suite_task import (
    TaskReward,
    action_range,
    build,
    headless,
    steps_of_episode,
)

INTEGRATION = mujoco.mjtState.mjSTATE_INTEGRATION


class SuiteEnvironment(Environment):
    """A task named as in `ball_in_cup-catch`; `wish` replaces its reward."""

    def __init__(self, name: str, action_repeat: int, wish: Wish | None = None) -> None:
        built = build(name)
        self._task, self._physics = built.task, headless(built.physics)
        self._wish = wish or TaskReward(self._task)
        self._repeat, self._name = action_repeat, name
        self.control_step = float(built.control_timestep())
        self.episode_steps = steps_of_episode(built)
        self._substeps = round(self.control_step / self._physics.timestep())
        self._centre, self._reach = action_range(built.action_spec())
        self._begin(0)
        self._ended = True
        self._observation = self._observe()
        self.observation_space = spaces.Box(-np.inf, np.inf, self._observation.shape, np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, self._centre.shape, np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start the episode that belongs to `seed`; without one, a seed is drawn."""
        super().reset(seed=seed, options=options)
        self._begin(int(self.np_random.integers(2**31)) if seed is None else seed)
        self._observation = self._observe()
        return self._observation.copy(), {"measures": self._wish.measures(self._physics)}

    def step(self, action: Action) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Hold the action for `action_repeat` control steps, or until the episode ends; rewards add up."""
        if self._ended:
            raise RuntimeError("step: the episode has ended, or none was started; call reset(seed=...) first")
        control = self._centre + self._reach * np.clip(action, -1.0, 1.0).astype(np.float64)
        reward, terminated, truncated = 0.0, False, False
        for _ in range(self._repeat):
            if terminated or truncated:
                break
            gained, terminated, truncated = self._control_step(control)
            reward += gained
        self._ended = terminated or truncated
        measures = self._wish.measures(self._physics)
        return self._observation.copy(), reward, terminated, truncated, {"measures": measures}

    @property
    def state_size(self) -> int:
        return int(mujoco.mj_stateSize(self.model, INTEGRATION))

    def physics_state(self) -> PhysicsState:
        state = np.empty(self.state_size, np.float64)
        mujoco.mj_getState(self.model, self.data, state, INTEGRATION)
        return state

    def get_state(self) -> EnvironmentState:
        return EnvironmentState(
            episode_seed=self._seed,
            step=self._step,
            ended=self._ended,
            physics=self.physics_state(),
            observation=self._observation.copy(),
            random=random_to_json(self._task.random),
        )

    def set_state(self, state: EnvironmentState) -> Observation:
        self._begin(state.episode_seed)
        self._enter(state.physics)
        random_from_json(self._task.random, state.random)
        self._step, self._ended = state.step, state.ended
        # Kept, not recomputed: acceleration sensors hold values of the moment before the state.
        self._observation = state.observation.copy()
        return self._observation.copy()

    # The scene: this simulator, drawn by the renderer ------------------------------------------------

    @property
    def scene(self) -> SuiteEnvironment:
        return self

    @property
    def name(self) -> str:
        return self._name

    @property
    def model(self) -> Any:
        return self._physics.model.ptr

    @property
    def data(self) -> Any:
        return self._physics.data.ptr

    def restore(self, episode_seed: int, state: PhysicsState) -> None:
        """Put the simulator into a state [S] of that episode; the episode cannot be stepped on from there."""
        if state.shape != (self.state_size,):
            size = self.state_size
            raise ValueError(f"state: shape {state.shape}, but a state of {self._name} has shape ({size},)")
        if episode_seed != self._seed:
            self._begin(episode_seed)
        self._enter(state)
        self._ended = True

    # ------------------------------------------------------------------------------------------------

    def _begin(self, seed: int) -> None:
        """Start an episode: everything random in it comes from `seed`."""
        seed_random(self._task.random, seed)
        with self._physics.reset_context():
            self._task.initialize_episode(self._physics)
        self._seed, self._step, self._ended = seed, 0, False
        self._wish.begin(self._physics)

    def _enter(self, state: PhysicsState) -> None:
        """Set the simulator's state; set again after `mj_forward`, which may touch the warm start."""
        mujoco.mj_setState(self.model, self.data, state, INTEGRATION)
        mujoco.mj_forward(self.model, self.data)
        mujoco.mj_setState(self.model, self.data, state, INTEGRATION)

    def _control_step(self, control: npt.NDArray[np.float64]) -> tuple[float, bool, bool]:
        """(reward, terminated, truncated) of one control step."""
        self._task.before_step(control, self._physics)
        try:
            self._physics.step(self._substeps)
        except PhysicsError:  # the simulation diverged: the episode is cut off before its nonsense is seen
            return 0.0, False, True
        self._task.after_step(self._physics)
        self._step += 1
        self._observation = self._observe()
        return self._wish.reward(self._physics), *self._ending()

    def _ending(self) -> tuple[bool, bool]:
        """(terminated, truncated): only the discount 0 says that nothing follows."""
        discount = self._task.get_termination(self._physics)
        terminated = discount is not None and discount == 0
        return terminated, not terminated and (discount is not None or self._step >= self.episode_steps)

    def _observe(self) -> Observation:
        parts = self._task.get_observation(self._physics).values()
        return np.concatenate([np.ravel(part) for part in parts]).astype(np.float32)
