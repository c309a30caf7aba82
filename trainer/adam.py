"""Adam (Kingma & Ba 2015) over a few flat tensors, each with a learning rate of its own.

`torch.optim.Adam` spends most of a small step around the arithmetic: it reads its options, its hooks and its
state anew each time. What is left here is its own fused operation and nothing else, to the same result.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor


class FlatAdam:
    """Steps tensors by their `.grad`; β = (0.9, 0.999), ε = 1e-8, no decay."""

    def __init__(self, *groups: tuple[Tensor, float]) -> None:
        self.tensors = [tensor for tensor, _ in groups]
        self.rates = [rate for _, rate in groups]
        self.first = [torch.zeros_like(tensor, requires_grad=False) for tensor in self.tensors]
        self.second = [torch.zeros_like(tensor, requires_grad=False) for tensor in self.tensors]
        self.steps = [torch.zeros((), device=tensor.device) for tensor in self.tensors]

    @torch.no_grad()
    def step(self) -> None:
        """One step of every tensor; RuntimeError when one has no gradient."""
        for tensor, rate, first, second, steps in zip(
            self.tensors, self.rates, self.first, self.second, self.steps, strict=True
        ):
            if tensor.grad is None:
                raise RuntimeError(f"a tensor of shape {tuple(tensor.shape)} has no gradient to step by")
            steps += 1
            torch._fused_adam_(
                [tensor],
                [tensor.grad],
                [first],
                [second],
                [],
                [steps],
                lr=rate,
                beta1=0.9,
                beta2=0.999,
                weight_decay=0.0,
                eps=1e-8,
                amsgrad=False,
                maximize=False,
            )

    def clear(self) -> None:
        """Forget the gradients, before autograd adds new ones."""
        for tensor in self.tensors:
            tensor.grad = None

    def state(self) -> dict[str, Any]:
        return {"first": self.first, "second": self.second, "steps": self.steps}

    def load(self, state: dict[str, Any]) -> None:
        for name, kept in self.state().items():
            for mine, saved in zip(kept, state[name], strict=True):
                mine.copy_(saved)
