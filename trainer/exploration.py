"""State-entropy exploration (paper, section 4.1): a reward for states far from all others in the buffer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import torch
from torch import Tensor

from labels_db.run_config import StateEntropy
from trainer.nearest_so_far import NearestSoFar
from trainer.neighbours import neighbour_distance
from trainer.randomness import Randomness
from trainer.replay_buffer import Batch, ReplayBuffer

TRANSFORMS: dict[str, Callable[[Tensor], Tensor]] = {
    "distance": lambda distance: distance,
    "log": lambda distance: torch.log(1e-6 + distance),
}


class RunningDeviation:
    """Standard deviation of everything seen so far, by Chan's pairwise update of the moments.

    The moments stay on the device: on a GPU nobody waits for them.
    """

    def __init__(self, device: torch.device | str = "cpu") -> None:
        self.count = 0
        self.mean, self.squares = torch.zeros(2, dtype=torch.float64, device=device)

    def update(self, values: Tensor) -> None:
        count, values = values.numel(), values.double()
        mean = values.mean()
        total = self.count + count
        shift = mean - self.mean
        self.squares = self.squares + (values - mean).square().sum() + shift**2 * (self.count * count / total)
        self.mean = self.mean + shift * (count / total)
        self.count = total

    @property
    def value(self) -> Tensor:
        """Population deviation; 1 until two different values have been seen."""
        variance = self.squares / max(self.count, 1)
        return torch.where(variance > 0, variance.sqrt(), 1.0)

    def state(self) -> dict[str, Any]:
        return dict(vars(self))

    def load(self, state: dict[str, Any]) -> None:
        self.count = state["count"]
        self.mean, self.squares = (
            torch.as_tensor(state[name], dtype=torch.float64, device=self.mean.device)
            for name in ("mean", "squares")
        )


def one_of_each_part(count: int, parts: int, generator: torch.Generator) -> Tensor:
    """A random row of each of so many parts of `count` rows: all different, in order, and nobody waits.

    Parts are equal but for one row, and begin anywhere on the ring of all rows, so that each is as likely.
    """
    device = generator.device
    ends = torch.arange(parts + 1, device=device) * count // parts
    chances = torch.rand(parts, generator=generator, device=device)
    first, sizes = ends[:-1], ends.diff()
    chosen = first + (chances * sizes).long().clamp(max=sizes - 1)
    begin = torch.randint(count, (1,), generator=generator, device=device)
    return ((chosen + begin) % count).sort().values


class StateEntropyReward:
    """r(s) = distance to the k-th neighbour in the buffer of the moment, over its running deviation.

    Computed when sampled, never stored; neither centred nor clipped.
    """

    def __init__(self, config: StateEntropy, buffer: ReplayBuffer, randomness: Randomness) -> None:
        self.config = config
        self.buffer = buffer
        self.deviation = RunningDeviation(buffer.device)
        self._nearest = NearestSoFar(config.neighbours)
        self._choosing = randomness.torch("states compared", buffer.device)

    def __call__(self, batch: Batch) -> Tensor:
        reward = TRANSFORMS[self.config.transform](self._distance(batch))
        self.deviation.update(reward)
        return reward / self.deviation.value

    def _distance(self, batch: Batch) -> Tensor:
        """To the k-th neighbour; what is known of states stays true while the buffer only grows."""
        buffer, all_count = self.buffer, self.config.states_compared is None
        if all_count and buffer.added <= buffer.capacity and buffer.device.type == "cpu":
            return self._nearest.distance(batch.rows, buffer.observations())
        states, own = self._compared(batch)
        return neighbour_distance(batch.observation, own, states, self.config.neighbours)

    def _compared(self, batch: Batch) -> tuple[Tensor, Tensor]:
        """The states that count, and where the batch's own are among them (−1: nowhere)."""
        states, most = self.buffer.observations(), self.config.states_compared
        if most is None or len(states) <= most:
            return states, batch.rows
        rows = one_of_each_part(len(states), most, self._choosing)
        place = torch.searchsorted(rows, batch.rows).clamp(max=len(rows) - 1)
        return states[rows], torch.where(rows[place] == batch.rows, place, -1)
