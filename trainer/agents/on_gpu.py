"""What lets a GPU work without pause: updates replayed as one graph, and actions that wait for none of them.

One update is some two hundred small kernels, and launching them one by one takes several times as long as running
them. Captured once as a CUDA graph they are launched together, and the processor is free for the environment.
"""

from __future__ import annotations

import copy
from dataclasses import fields

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from trainer.agents.sac_update import SACLosses, Update
from trainer.devices import on_device
from trainer.networks import Actor
from trainer.replay_buffer import Batch


class CapturedUpdate:
    """Makes its first updates one kernel at a time, then captures one and replays it ever after.

    Batches keep their size. The losses it returns are overwritten by the next update.
    """

    PLAINLY = 3
    """Updates before the capture, in which networks, optimisers and libraries make what they keep."""

    def __init__(self, update: Update) -> None:
        self._update = update
        self._plainly = 0
        self._graph: torch.cuda.CUDAGraph | None = None

    def __call__(self, batch: Batch, rewards: Tensor, noise: Tensor) -> SACLosses:
        if self._plainly < self.PLAINLY:
            self._plainly += 1
            return self._update(batch, rewards, noise)
        if self._graph is None:
            self._graph = self._capture(batch, rewards, noise)
        for kept, given in zip(self._given, (*_columns(batch), rewards, noise), strict=True):
            kept.copy_(given)
        self._graph.replay()
        return self._losses

    def refresh(self) -> None:
        self._update.refresh()

    def target_moved(self) -> None:
        self._update.target_moved()

    def _capture(self, batch: Batch, rewards: Tensor, noise: Tensor) -> torch.cuda.CUDAGraph:
        """Record the update's kernels on inputs of its own, without running them."""
        columns = [column.clone() for column in _columns(batch)]
        self._given = [*columns, rewards.clone(), noise.clone()]
        graph = torch.cuda.CUDAGraph()
        with torch.cuda.graph(graph):
            self._losses = self._update(Batch(*columns), *self._given[-2:])
        return graph


def _columns(batch: Batch) -> list[Tensor]:
    return [getattr(batch, field.name) for field in fields(batch)]


class ActorBeside:
    """The actor as it was before the update under way, on a stream of its own."""

    def __init__(self, actor: Actor) -> None:
        self._learning = actor
        self._acting = copy.deepcopy(actor).requires_grad_(False)
        self._device = actor.trunk.flat.device
        self._stream = torch.cuda.Stream(self._device)  # type: ignore[no-untyped-call]
        self.follow()

    @torch.no_grad()
    def follow(self) -> None:
        """Take over what has been learned; to be called before an update begins."""
        self._acting.trunk.flat.copy_(self._learning.trunk.flat)
        self._stream.wait_stream(torch.cuda.current_stream(self._device))

    def explore(self, observations: NDArray[np.float32], generator: torch.Generator) -> NDArray[np.float32]:
        """Actions [N, A] drawn for observations [N, D]; waits for them, not for the update."""
        with torch.cuda.stream(self._stream):
            observed = on_device(observations, self._device)
            size = (len(observed), self._acting.trunk.sizes[-1] // 2)
            noise = torch.randn(size, generator=generator, device=self._device)
            actions: NDArray[np.float32] = self._acting.explore(observed, noise).cpu().numpy()
            return actions
