"""State-entropy exploration (paper, section 4.1): a reward for states far from all others in the buffer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import torch
from torch import Tensor

from labels_db.run_config import StateEntropy
from trainer.replay_buffer import Batch, ReplayBuffer

TRANSFORMS: dict[str, Callable[[Tensor], Tensor]] = {
    "distance": lambda distance: distance,
    "log": lambda distance: torch.log(1e-6 + distance),
}


def neighbour_distance(rows: Tensor, states: Tensor, k: int) -> Tensor:
    """L2 distance from each of `states[rows]` to its k-th nearest among all `states` but itself: [B].

    With no more than k states the farthest stands in.
    """
    distance = torch.cdist(states[rows], states, compute_mode="donot_use_mm_for_euclid_dist")
    distance[torch.arange(len(rows), device=states.device), rows] = torch.inf
    # The k smallest and the last of them: several times faster than `kthvalue` on a CPU.
    return distance.topk(max(1, min(k, len(states) - 1)), dim=1, largest=False).values[:, -1]


class RunningDeviation:
    """Standard deviation of everything seen so far, by Chan's pairwise update of the moments."""

    def __init__(self) -> None:
        self.count = 0
        self.mean = 0.0
        self.squares = 0.0

    def update(self, values: Tensor) -> None:
        count, mean = values.numel(), float(values.mean())
        squares = float(((values - mean) ** 2).sum())
        total = self.count + count
        shift = mean - self.mean
        self.squares += squares + shift**2 * self.count * count / total
        self.mean += shift * count / total
        self.count = total

    @property
    def value(self) -> float:
        """Population deviation; 1 until two different values have been seen."""
        variance = self.squares / self.count if self.count else 0.0
        return float(variance**0.5) if variance > 0 else 1.0

    def state(self) -> dict[str, Any]:
        return dict(vars(self))

    def load(self, state: dict[str, Any]) -> None:
        vars(self).update(state)


class StateEntropyReward:
    """r(s) = distance to the k-th neighbour in the buffer of the moment, over its running deviation.

    Computed when sampled, never stored; neither centred nor clipped.
    """

    def __init__(self, config: StateEntropy, buffer: ReplayBuffer) -> None:
        self.config = config
        self.buffer = buffer
        self.deviation = RunningDeviation()

    def __call__(self, batch: Batch) -> Tensor:
        distance = neighbour_distance(batch.rows, self.buffer.observations(), self.config.neighbours)
        reward = TRANSFORMS[self.config.transform](distance)
        self.deviation.update(reward)
        return reward / self.deviation.value
