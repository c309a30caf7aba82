"""The replay buffer: a ring of transitions whose rewards can all be written again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import torch
from torch import Tensor

from trainer.devices import on_device

if TYPE_CHECKING:
    from trainer.collector import Transitions

RewardFunction = Callable[[Tensor], Tensor]
"""Observation and action joined, [B, D + A] → reward [B]."""


@dataclass(frozen=True)
class Batch:
    """Transitions, and the rows they come from."""

    rows: Tensor
    observation: Tensor
    action: Tensor
    reward: Tensor
    next_observation: Tensor
    not_terminated: Tensor

    @property
    def inputs(self) -> Tensor:
        """Observation and action joined, as critics and reward models take them."""
        return torch.cat([self.observation, self.action], -1)


class ReplayBuffer:
    """At most `capacity` transitions; the oldest give way. `added` counts every one since the start."""

    COLUMNS = ("observation", "action", "next_observation", "not_terminated")
    RELABEL_ROWS = 10_000

    def __init__(
        self, capacity: int, observation_size: int, action_size: int, device: torch.device | str = "cpu"
    ) -> None:
        self.capacity = capacity
        self.added = 0
        self.device = torch.device(device)
        # One table, so that a minibatch is gathered at once; the columns are views of it.
        self._sizes = [observation_size, action_size, 1, observation_size, 1]
        self.table = torch.empty(capacity, sum(self._sizes), device=device)
        self.inputs = self.table[:, : observation_size + action_size]
        self.observation, self.action, self.reward, self.next_observation, self.not_terminated = (
            self._columns(self.table)
        )

    def _columns(self, rows: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor, Tensor]:
        observation, action, reward, following, going_on = torch.split_with_sizes(rows, self._sizes, 1)
        return observation, action, reward[:, 0], following, going_on[:, 0]

    def __len__(self) -> int:
        return min(self.added, self.capacity)

    def remember(self, transitions: Transitions, rewards: Tensor) -> None:
        """Append one step of N environments with its rewards [N]."""
        lived, blank = transitions, np.zeros((len(rewards), 1), np.float32)
        going_on = ~lived.terminated[:, None]
        columns = (lived.observations, lived.actions, blank, lived.next_observations, going_on)
        rows = on_device(np.concatenate(columns, 1, dtype=np.float32), self.device)
        self._columns(rows)[2].copy_(rewards)
        self._append(rows)

    def _append(self, rows: Tensor) -> None:
        start = self.added % self.capacity
        until_the_end = rows[: self.capacity - start]
        self.table[start : start + len(until_the_end)] = until_the_end
        self.table[: len(rows) - len(until_the_end)] = rows[len(until_the_end) :]
        self.added += len(rows)

    def sample(self, size: int, generator: torch.Generator) -> Batch:
        """Uniform with replacement."""
        rows = torch.randint(len(self), (size,), generator=generator, device=self.device)
        return self.batch(rows)

    def latest(self, count: int) -> Batch:
        """The last `count` transitions, oldest first."""
        return self.batch(torch.arange(self.added - count, self.added, device=self.device) % self.capacity)

    def batch(self, rows: Tensor) -> Batch:
        """The transitions in those rows [B]."""
        return Batch(rows, *self._columns(self.table.index_select(0, rows)))

    def observations(self) -> Tensor:
        """Every stored observation, [len, D]."""
        return self.observation[: len(self)]

    @torch.no_grad()
    def relabel(self, reward: RewardFunction, between_parts: Callable[[], None] = lambda: None) -> None:
        """Write the stored reward of every valid row anew (Algorithm 2, line 17), wrapped ring or not.

        In place and in parts; what is called between them may raise to break it off.
        """
        for start in range(0, len(self), self.RELABEL_ROWS):
            rows = slice(start, min(start + self.RELABEL_ROWS, len(self)))
            self.reward[rows] = reward(self.inputs[rows])
            between_parts()
