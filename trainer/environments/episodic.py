"""What every family shares: an action held for some control steps, and where its episode is."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from trainer.environments.interface import Action, Environment, EnvironmentState, Observation

Control = npt.NDArray[np.float64]


class EpisodicEnvironment(Environment):
    """A family says how an episode begins, what a control step does, and how to go to a state."""

    _repeat: int
    _observation: Observation
    _seed = _step = 0
    _ended = True

    def _make_ready(self, action_size: int, action_repeat: int) -> None:
        """Go through a first beginning, which shows the observation's size; episodes start with `reset`."""
        self._repeat = action_repeat
        self._start(0)
        self._ended = True
        self.observation_space = spaces.Box(-np.inf, np.inf, self._observation.shape, np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, (action_size,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start the episode that belongs to `seed`; without one, a seed is drawn."""
        super().reset(seed=seed, options=options)
        self._start(int(self.np_random.integers(2**31)) if seed is None else seed)
        return self._observation.copy(), {"measures": self._measures()}

    def step(self, action: Action) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Hold the action for `action_repeat` control steps, or until the episode ends; rewards add up."""
        if self._ended:
            raise RuntimeError("step: the episode has ended, or none was started; call reset(seed=...) first")
        control = np.clip(action, -1.0, 1.0).astype(np.float64)
        reward, terminated, truncated = 0.0, False, False
        moments = []
        for _ in range(self._repeat):
            if not (terminated or truncated):
                moments.append(self.physics_state())
                gained, terminated, truncated = self._one_step(control)
                reward += gained
        self.moments = np.stack(moments + moments[-1:] * (self._repeat - len(moments)))
        self._ended = terminated or truncated
        self._observation = self._observe()  # only now: the agent sees nothing in between
        return self._observation.copy(), reward, terminated, truncated, {"measures": self._measures()}

    def get_state(self) -> EnvironmentState:
        return EnvironmentState(
            episode_seed=self._seed,
            step=self._step,
            ended=self._ended,
            physics=self.physics_state(),
            observation=self._observation.copy(),
            **self._beside_physics(),
        )

    def set_state(self, state: EnvironmentState) -> Observation:
        self._start(state.episode_seed)
        self._go_to(state)
        self._step, self._ended = state.step, state.ended
        # Kept, not recomputed: acceleration sensors hold values of the moment before the state.
        self._observation = state.observation.copy()
        return self._observation.copy()

    def _start(self, seed: int) -> None:
        """Start an episode: everything random in it comes from `seed`."""
        self._seed, self._step, self._ended = seed, 0, False
        self._begin(seed)
        self._observation = self._observe()

    def _one_step(self, control: Control) -> tuple[float, bool, bool]:
        """(reward, terminated, truncated) of one control step; an episode out of time is truncated."""
        reward, terminated, truncated = self._control_step(control)
        self._step += 1
        truncated = not terminated and (truncated or self._step >= self.episode_steps)
        return reward, terminated, truncated

    # What a family gives -----------------------------------------------------------------------------

    @abstractmethod
    def _begin(self, seed: int) -> None:
        """Put everything to the start of that seed's episode."""

    @abstractmethod
    def _control_step(self, control: Control) -> tuple[float, bool, bool]:
        """(reward, terminated, truncated) of a control [A] in [-1, 1]."""

    @abstractmethod
    def _observe(self) -> Observation:
        """What is seen [D] after the beginning or the last control step."""

    @abstractmethod
    def _measures(self) -> dict[str, float]:
        """What has been reached so far in the episode."""

    @abstractmethod
    def _beside_physics(self) -> dict[str, dict[str, Any]]:
        """The state's `random`, `wish` and `task`, as far as there are any."""

    @abstractmethod
    def _go_to(self, state: EnvironmentState) -> None:
        """From the start of the state's episode to the state."""
