"""Episodes as they are lived, and the pool of the last finished ones that segments are cut from."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


@dataclass
class Episode:
    """One episode: step t holds s_t, a_t, r_t and the simulator's states while a_t was held."""

    number: int
    seed: int
    policy_step: int
    columns: dict[str, list[Array]] = field(
        default_factory=lambda: {"observations": [], "actions": [], "rewards": [], "states": []}
    )

    def append(self, **values: Array) -> None:
        for name, value in values.items():
            self.columns[name].append(value)

    def __len__(self) -> int:
        return len(self.columns["rewards"])


@dataclass(frozen=True)
class FinishedEpisode:
    """observations [L, D], actions [L, A], rewards [L], states [L, action_repeat, S]."""

    number: int
    seed: int
    policy_step: int
    observations: Array
    actions: Array
    rewards: Array
    states: Array

    def __len__(self) -> int:
        return len(self.rewards)

    @property
    def true_return(self) -> float:
        return float(self.rewards.sum())


def stacked_columns(episode: Episode) -> dict[str, Array]:
    """Every column that holds something, [L, …]."""
    return {name: np.stack(values) for name, values in episode.columns.items() if values}


def finished(episode: Episode) -> FinishedEpisode:
    stacked = stacked_columns(episode)
    return FinishedEpisode(episode.number, episode.seed, episode.policy_step, **stacked)


class EpisodePool:
    """The last `size` finished episodes, oldest first."""

    def __init__(self, size: int) -> None:
        self.episodes: deque[FinishedEpisode] = deque(maxlen=size)

    def add(self, episode: FinishedEpisode) -> None:
        self.episodes.append(episode)

    def at_least(self, length: int) -> list[FinishedEpisode]:
        return [episode for episode in self.episodes if len(episode) >= length]
