"""Observations less their running mean, by their running deviation: what on-policy learners like to see."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from trainer.policy_layers import PolicyLayer


class Normaliser:
    """(x − mean) / √(variance + ε), held between −10 and 10; moments by Chan's pairwise update, in float64."""

    EPSILON = 1e-8

    def __init__(self, size: int, *, learns: bool) -> None:
        """Without `learns` observations pass as they are."""
        self.learns = learns
        self.count = 0
        self.mean = np.zeros(size)
        self.squares = np.zeros(size)

    def update(self, observations: NDArray[np.float32]) -> None:
        """Take N more observations [N, D] into account."""
        if not self.learns:
            return
        count, mean = len(observations), observations.mean(0, dtype=np.float64)
        squares = ((observations - mean) ** 2).sum(0)
        total, shift = self.count + count, mean - self.mean
        self.squares = self.squares + squares + shift**2 * self.count * count / total
        self.mean = self.mean + shift * count / total
        self.count = total

    def __call__(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """[N, D] → [N, D]."""
        return self.layer()(observations) if self.learns else observations

    def layer(self) -> PolicyLayer:
        """The same as the first layer of a policy."""
        scale = (
            1 / np.sqrt(self.squares / self.count + self.EPSILON) if self.count else np.ones_like(self.mean)
        )
        weight, bias = np.diag(scale), -self.mean * scale
        return PolicyLayer(weight.astype(np.float32), bias.astype(np.float32), "clip_10")

    def state(self) -> dict[str, Any]:
        return {"count": self.count, "mean": self.mean, "squares": self.squares}

    def load(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
