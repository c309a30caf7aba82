"""The reward model: an ensemble r̂ learned from preferences (paper, section 4.2, equations 3 and 4)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from labels_db.records import FitReport
from labels_db.run_config import LearnedReward
from trainer.adam import FlatAdam
from trainer.networks import EnsembleMLP, linear_default
from trainer.passes import Passes, Room
from trainer.randomness import Randomness

LEAKY_SLOPE = 0.01
LAYER_BYTES = {"cpu": 1 << 21, "cuda": 1 << 28}
"""What one layer of all members may take at a time: all together then stay in a processor's cache, or fill a GPU."""


@dataclass(frozen=True)
class Preferences:
    """The preference dataset D: pairs of segments (σ⁰, σ¹) and y, the share that prefers the second.

    Inputs are observation and action joined, [n, H, D + A]; y is [n] in [0, 1], ½ for equal.
    """

    first: Tensor
    second: Tensor
    label: Tensor

    def __len__(self) -> int:
        return len(self.label)

    def __getitem__(self, rows: Tensor) -> Preferences:
        return Preferences(self.first[rows], self.second[rows], self.label[rows])


def preference_logit(first_sums: Tensor, second_sums: Tensor) -> Tensor:
    """log-odds of P[σ¹ ≻ σ⁰] = softmax of the segments' undiscounted sums of r̂ (equation 3)."""
    return second_sums - first_sums


def smoothed(label: Tensor, smoothing: float) -> Tensor:
    """The label with a share of it moved to ½."""
    return label + smoothing * (0.5 - label)


def correct(logit: Tensor, label: Tensor) -> Tensor:
    """Whether each member says what the teacher said, [E, m]; pairs called equal are left out."""
    decided = label != 0.5
    return (logit[:, decided] > 0) == (label[decided] > 0.5)


class RewardModel:
    """E networks of (s, a), each ending in tanh: r̂ ∈ (−1, 1) is their plain mean."""

    def __init__(
        self,
        config: LearnedReward,
        observation_size: int,
        action_size: int,
        randomness: Randomness,
        device: torch.device,
        precision: torch.dtype = torch.float32,
    ) -> None:
        self.config = config
        self.device = device
        sizes = [observation_size + action_size, *[config.width] * config.depth, 1]
        weights = randomness.torch("reward weights")
        self._order = randomness.torch("reward batches")
        self.members = EnsembleMLP(config.members, sizes, LEAKY_SLOPE, linear_default, weights).to(device)
        self.optimizer = FlatAdam((self.members.flat, config.learning_rate))
        self._passes = Passes(self.members, precision, Room(device))
        bytes_per_row = config.members * config.width * torch.empty(0, dtype=precision).element_size()
        self._rows = max(64, LAYER_BYTES[device.type] // bytes_per_row)

    # What it says --------------------------------------------------------------------------------

    def __call__(self, inputs: Tensor) -> Tensor:
        """r̂(s, a), the mean over members, of observation and action joined: [B, D + A] → [B]."""
        return self.member_rewards(inputs).mean(0)

    @torch.no_grad()
    def member_rewards(self, inputs: Tensor) -> Tensor:
        """Each member's reward, [B, D + A] → [E, B]."""
        parts = [torch.tanh(self._passes.forward(rows)[..., 0]) for rows in torch.split(inputs, self._rows)]
        return torch.cat(parts, 1)

    def segment_sums(self, segments: Tensor) -> Tensor:
        """Each member's undiscounted sum over each segment, [n, H, D + A] → [E, n]."""
        count, steps = segments.shape[:2]
        return self.member_rewards(segments.flatten(0, 1)).view(-1, count, steps).sum(-1)

    def probabilities(self, first: Tensor, second: Tensor) -> Tensor:
        """Each member's P[σ¹ ≻ σ⁰], [n, H, D + A] twice → [E, n]."""
        return torch.sigmoid(preference_logit(self.segment_sums(first), self.segment_sums(second)))

    # How it learns -------------------------------------------------------------------------------

    def fit(self, preferences: Preferences, fresh: Preferences | None = None) -> FitReport:
        """Up to `max_epochs` passes over D, until an epoch's training accuracy is high enough.

        `fresh` are the answers not trained on yet: accuracy on them, measured first, is the honest one.
        """
        fresh_accuracy = None if fresh is None or not len(fresh) else self.accuracy(fresh)
        accuracy, epochs = None, 0
        for _ in range(self.config.max_epochs):
            accuracy, epochs = self._epoch(preferences), epochs + 1
            if accuracy is not None and accuracy > self.config.stop_accuracy:
                break
        return FitReport(len(preferences), epochs, accuracy, fresh_accuracy)

    def accuracy(self, preferences: Preferences) -> float | None:
        """Share of decided pairs on which a member agrees with the teacher, over all members."""
        logit = preference_logit(self.segment_sums(preferences.first), self.segment_sums(preferences.second))
        return _share(correct(logit, preferences.label))

    def _epoch(self, preferences: Preferences) -> float | None:
        return _share(torch.cat([self._learn(preferences, rows) for rows in self._batches(len(preferences))]))

    def _batches(self, count: int) -> Iterator[Tensor]:
        """Rows of D for each member, [E, b]: every member goes through its own permutation."""
        orders = torch.stack(
            [torch.randperm(count, generator=self._order) for _ in range(self.config.members)]
        )
        yield from torch.split(orders.to(self.device), self.config.batch_size, dim=1)

    @torch.no_grad()
    def _learn(self, preferences: Preferences, rows: Tensor) -> Tensor:
        """One step of Adam on each member's own batch, rows [E, b]; returns what was right before it.

        The batch goes through in parts small enough for the processor's cache; their gradients add up.
        """
        gradients, right = torch.zeros_like(self.members.flat), []
        pairs = max(1, self._rows // (2 * preferences.first.shape[1]))
        for part in torch.split(rows, pairs, dim=1):
            right.append(self._backward(preferences, part, 1 / rows.shape[1]))
            gradients += self._passes.gradient
        self._passes.gradient.copy_(gradients)
        self.optimizer.step()
        self._passes.refresh()
        return torch.cat(right)

    def _backward(self, preferences: Preferences, rows: Tensor, weight: float) -> Tensor:
        """The gradient of a weighted sum of losses, rows [E, b]; the derivative of one by its logit is P − y."""
        label = preferences.label[rows]
        inputs = torch.cat([preferences.first[rows], preferences.second[rows]], 1)
        rewards = torch.tanh(self._passes.forward(inputs.flatten(1, 2))[..., 0]).view(*inputs.shape[:3])
        first, second = rewards.sum(-1).chunk(2, 1)
        logit = preference_logit(first, second)
        by_logit = (torch.sigmoid(logit) - smoothed(label, self.config.label_smoothing)) * weight
        by_reward = torch.cat([-by_logit, by_logit], 1)[..., None] * (1 - rewards**2)
        self._passes.backward(by_reward.flatten(1)[..., None])
        return ((logit > 0) == (label > 0.5))[label != 0.5]

    # Checkpoints ---------------------------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        return {"members": self.members.state_dict(), "optimizer": self.optimizer.state()}

    def load(self, state: dict[str, Any]) -> None:
        self.members.load_state_dict(state["members"])
        self.optimizer.load(state["optimizer"])
        self._passes.refresh()


def _share(right: Tensor) -> float | None:
    return float(right.float().mean()) if right.numel() else None
