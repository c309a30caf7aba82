"""Living through episodes: N environments stepped side by side, every episode from a seed of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trainer.environments.interface import Environment, EnvironmentState
from trainer.episodes import Episode, EpisodePool, finished, stacked_columns
from trainer.randomness import derived_seed


@dataclass(frozen=True)
class Transitions:
    """One step of N environments; `episode_returns` are true returns of the episodes that ended with it."""

    observations: NDArray[np.float32]
    actions: NDArray[np.float32]
    true_rewards: NDArray[np.float32]
    next_observations: NDArray[np.float32]
    terminated: NDArray[np.bool_]
    ended: NDArray[np.bool_]
    """Terminated or truncated."""
    episode_returns: tuple[float, ...]


class Collector:
    """Steps the environments and keeps finished episodes in the pool, if there is one to ask from."""

    def __init__(self, environments: Sequence[Environment], seed: int, pool: EpisodePool | None) -> None:
        self.environments = environments
        self.seed = seed
        self.pool = pool
        self.started = [0] * len(environments)
        self.returns = [0.0] * len(environments)
        self.episodes: list[Episode] = []
        self.observations: NDArray[np.float32] = np.empty(0, np.float32)

    def start(self) -> None:
        """Reset every environment: where a run begins."""
        self.episodes = [self._new_episode(index, 0) for index in range(len(self.environments))]
        self.observations = np.stack(
            [env.reset(seed=ep.seed)[0] for env, ep in zip(self.environments, self.episodes, strict=True)]
        )

    def step(self, actions: NDArray[np.float32], step: int) -> Transitions:
        """Take the actions [N, A]; environments whose episode ends begin their next."""
        before = self.observations
        lived = [self._step_one(index, action) for index, action in enumerate(actions)]
        following = np.stack([observation for observation, *_ in lived])
        self.observations = following.copy()
        returns = [self._end_episode(i, step) for i, (*_, ended) in enumerate(lived) if ended]
        return Transitions(
            observations=before,
            actions=actions,
            true_rewards=np.array([reward for _, reward, *_ in lived], np.float32),
            next_observations=following,
            terminated=np.array([terminated for _, _, terminated, _ in lived]),
            ended=np.array([ended for *_, ended in lived]),
            episode_returns=tuple(returns),
        )

    def _step_one(self, index: int, action: NDArray[np.float32]) -> tuple[Any, float, bool, bool]:
        environment = self.environments[index]
        observation, reward, terminated, truncated, _ = environment.step(action)
        self.returns[index] += float(reward)
        if self.pool is not None:
            self.episodes[index].append(
                observations=self.observations[index],
                actions=action,
                rewards=np.asarray(reward, np.float32),
                states=environment.moments,
            )
        return observation, float(reward), terminated, terminated or truncated

    def _end_episode(self, index: int, step: int) -> float:
        if self.pool is not None:
            self.pool.add(finished(self.episodes[index]))
        self.episodes[index] = self._new_episode(index, step)
        self.observations[index] = self.environments[index].reset(seed=self.episodes[index].seed)[0]
        true_return, self.returns[index] = self.returns[index], 0.0
        return true_return

    def _new_episode(self, index: int, step: int) -> Episode:
        """Numbered so that no two episodes of the N environments share a number."""
        count = self.started[index]
        self.started[index] += 1
        seed = derived_seed(self.seed, "episode", index, count)
        return Episode(count * len(self.environments) + index, seed, step)

    # Checkpoints ---------------------------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        """The unfinished episodes and the simulators in their middle; the pool is kept by itself."""
        return {
            "environments": [env.get_state().to_json() for env in self.environments],
            "episodes": [_episode_state(episode) for episode in self.episodes],
            "started": list(self.started),
            "returns": list(self.returns),
            "observations": self.observations,
        }

    def load(self, state: dict[str, Any]) -> None:
        for environment, saved in zip(self.environments, state["environments"], strict=True):
            environment.set_state(EnvironmentState.from_json(saved))
        self.episodes = [_episode_from(saved) for saved in state["episodes"]]
        self.started, self.returns = state["started"], state["returns"]
        self.observations = state["observations"].copy()


def _episode_state(episode: Episode) -> dict[str, Any]:
    return {**vars(episode), "columns": stacked_columns(episode)}


def _episode_from(saved: dict[str, Any]) -> Episode:
    episode = Episode(saved["number"], saved["seed"], saved["policy_step"])
    for name, column in saved["columns"].items():
        episode.columns[name] = list(column)
    return episode
