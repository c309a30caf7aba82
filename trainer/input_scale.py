"""Standardised inputs of reward models: what differs between segments weighs as much whatever its unit."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor

LEAST_DEVIATION = 0.01
"""What hardly varies is magnified a hundredfold at most: it may vary more once the robot has learned more."""


class InputScale:
    """(x − mean) / deviation of each of the inputs, by the steps of the answered segments."""

    def __init__(self, size: int, device: torch.device, *, learns: bool) -> None:
        """Without `learns` inputs pass as they are."""
        self.learns = learns
        self.mean = torch.zeros(size, device=device)
        self.scale = torch.ones(size, device=device)

    def learn(self, *segments: Tensor) -> None:
        """Take the moments of all steps of those segments [n, H, D + A], instead of any before."""
        if self.learns:
            steps = torch.cat(segments).flatten(0, 1)
            self.mean = steps.mean(0)
            self.scale = 1 / steps.std(0, correction=0).clamp_min(LEAST_DEVIATION)

    def __call__(self, inputs: Tensor) -> Tensor:
        """[…, D + A] → […, D + A]."""
        return (inputs - self.mean) * self.scale if self.learns else inputs

    def state(self) -> dict[str, Any]:
        return {"mean": self.mean, "scale": self.scale}

    def load(self, state: dict[str, Any]) -> None:
        self.mean, self.scale = state["mean"].to(self.mean), state["scale"].to(self.scale)
