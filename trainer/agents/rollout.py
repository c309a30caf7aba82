"""A rollout: what an on-policy agent remembers of its latest T steps in N environments, besides transitions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]


class Rollout:
    """Columns of T rows, each [N, …]; `filled` of them hold a step."""

    def __init__(self, steps: int, environments: int, observation_size: int, action_size: int) -> None:
        self.filled = 0
        self.columns: dict[str, Array] = {
            "observations": np.zeros(
                (steps, environments, observation_size), np.float32
            ),  # as the policy saw
            "actions": np.zeros((steps, environments, action_size), np.float32),  # before they were clipped
            "values": np.zeros((steps, environments), np.float32),
            "log_probs": np.zeros((steps, environments), np.float32),
            "starts": np.zeros((steps, environments), np.float32),  # 1 where an episode begins
            "bootstraps": np.zeros((steps, environments), np.float32),  # γ·V(s') where one was cut off
        }

    @property
    def full(self) -> bool:
        return self.filled == len(self.columns["values"])

    def append(self, **row: Array) -> None:
        """One step of every environment."""
        for name, value in row.items():
            self.columns[name][self.filled] = value
        self.filled += 1

    def state(self) -> dict[str, Any]:
        return {name: column[: self.filled] for name, column in self.columns.items()}

    def load(self, state: dict[str, Any]) -> None:
        self.filled = len(state["values"])
        for name, rows in state.items():
            self.columns[name][: self.filled] = rows
