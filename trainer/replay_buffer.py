"""The replay buffer: a ring of transitions whose rewards can all be written again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

RewardFunction = Callable[[Tensor, Tensor], Tensor]
"""(observation [B, D], action [B, A]) → reward [B]."""


@dataclass(frozen=True)
class Batch:
    """Transitions, and the rows they come from."""

    rows: Tensor
    observation: Tensor
    action: Tensor
    reward: Tensor
    next_observation: Tensor
    not_terminated: Tensor


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
        self.observation = torch.empty(capacity, observation_size, device=device)
        self.action = torch.empty(capacity, action_size, device=device)
        self.reward = torch.empty(capacity, device=device)
        self.next_observation = torch.empty(capacity, observation_size, device=device)
        self.not_terminated = torch.empty(capacity, device=device)

    def __len__(self) -> int:
        return min(self.added, self.capacity)

    def add(
        self,
        observation: Tensor,
        action: Tensor,
        reward: Tensor,
        next_observation: Tensor,
        terminated: Tensor,
    ) -> None:
        """Append N transitions, given as [N, …]."""
        count = len(reward)
        rows = torch.arange(self.added, self.added + count, device=self.device) % self.capacity
        self.observation[rows] = observation
        self.action[rows] = action
        self.reward[rows] = reward
        self.next_observation[rows] = next_observation
        self.not_terminated[rows] = 1.0 - terminated.float()
        self.added += count

    def sample(self, size: int, generator: torch.Generator) -> Batch:
        """Uniform with replacement."""
        rows = torch.randint(len(self), (size,), generator=generator, device=self.device)
        return Batch(
            rows,
            self.observation[rows],
            self.action[rows],
            self.reward[rows],
            self.next_observation[rows],
            self.not_terminated[rows],
        )

    def observations(self) -> Tensor:
        """Every stored observation, [len, D]."""
        return self.observation[: len(self)]

    @torch.no_grad()
    def relabel(self, reward: RewardFunction) -> None:
        """Write the stored reward of every valid row anew (Algorithm 2, line 17), wrapped ring or not."""
        for start in range(0, len(self), self.RELABEL_ROWS):
            rows = slice(start, min(start + self.RELABEL_ROWS, len(self)))
            self.reward[rows] = reward(self.observation[rows], self.action[rows])
