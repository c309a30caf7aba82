"""The reward model: an ensemble r̂ learned from preferences (paper, section 4.2, equations 3 and 4)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import torch
import torch.nn.functional as F  # noqa: N812  (PyTorch's own convention)
from torch import Tensor

from labels_db.records import FitReport
from labels_db.run_config import LearnedReward
from trainer.networks import EnsembleMLP, linear_default
from trainer.randomness import Randomness

leaky_relu = partial(F.leaky_relu, negative_slope=0.01)


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


def preference_loss(logit: Tensor, label: Tensor, smoothing: float = 0.0) -> Tensor:
    """Cross-entropy with soft targets (equation 4), each pair's: [E, n] and [n] → [E, n]."""
    soft = label + smoothing * (0.5 - label)
    return F.binary_cross_entropy_with_logits(logit, soft.expand_as(logit), reduction="none")


def correct(logit: Tensor, label: Tensor) -> Tensor:
    """Whether each member says what the teacher said, [E, m]; pairs called equal are left out."""
    decided = label != 0.5
    return (logit[:, decided] > 0) == (label[decided] > 0.5)


class RewardModel:
    """E networks of (s, a), each ending in tanh: r̂ ∈ (−1, 1) is their plain mean."""

    ROWS = 65_536
    """State-action pairs evaluated at a time where gradients are not needed."""

    def __init__(
        self,
        config: LearnedReward,
        observation_size: int,
        action_size: int,
        randomness: Randomness,
        device: torch.device,
    ) -> None:
        self.config = config
        self.device = device
        sizes = [observation_size + action_size, *[config.width] * config.depth, 1]
        weights = randomness.torch("reward weights")
        self._order = randomness.torch("reward batches")
        self.members = EnsembleMLP(config.members, sizes, leaky_relu, linear_default, weights).to(device)
        self.optimizer = torch.optim.Adam(self.members.parameters(), lr=config.learning_rate, fused=True)

    # What it says --------------------------------------------------------------------------------

    def __call__(self, observation: Tensor, action: Tensor) -> Tensor:
        """r̂(s, a), the mean over members: [B, D], [B, A] → [B]."""
        with torch.no_grad():
            return self._rewards(torch.cat([observation, action], -1)).mean(0)

    def _rewards(self, inputs: Tensor) -> Tensor:
        """Each member's reward, [B, D + A] → [E, B]."""
        return torch.tanh(self.members(inputs)[..., 0])

    def segment_sums(self, segments: Tensor) -> Tensor:
        """Each member's undiscounted sum over each segment, [n, H, D + A] → [E, n]."""
        count, steps = segments.shape[:2]
        return self._rewards(segments.flatten(0, 1)).view(-1, count, steps).sum(-1)

    @torch.no_grad()
    def probabilities(self, first: Tensor, second: Tensor) -> Tensor:
        """Each member's P[σ¹ ≻ σ⁰], [n, H, D + A] twice → [E, n]."""
        rows = max(1, self.ROWS // first.shape[1])
        parts = [
            torch.sigmoid(preference_logit(self.segment_sums(a), self.segment_sums(b)))
            for a, b in zip(torch.split(first, rows), torch.split(second, rows), strict=True)
        ]
        return torch.cat(parts, 1)

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

    @torch.no_grad()
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

    def _learn(self, preferences: Preferences, rows: Tensor) -> Tensor:
        """One step of Adam on each member's own batch, rows [E, b]; returns what was right before it."""
        label = preferences.label[rows]
        logit = preference_logit(
            self._own_sums(preferences.first[rows]), self._own_sums(preferences.second[rows])
        )
        loss = preference_loss(logit, label, self.config.label_smoothing).mean(1).sum()
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]
        self.optimizer.step()
        decided = label != 0.5
        return ((logit.detach() > 0) == (label > 0.5))[decided]

    def _own_sums(self, segments: Tensor) -> Tensor:
        """Sums of each member over its own segments, [E, b, H, D + A] → [E, b]."""
        members, count, steps = segments.shape[:3]
        rewards: Tensor = self.members(segments.flatten(1, 2))[..., 0]
        return torch.tanh(rewards).view(members, count, steps).sum(-1)

    # Checkpoints ---------------------------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        return {"members": self.members.state_dict(), "optimizer": self.optimizer.state_dict()}

    def load(self, state: dict[str, Any]) -> None:
        self.members.load_state_dict(state["members"])
        self.optimizer.load_state_dict(state["optimizer"])


def _share(right: Tensor) -> float | None:
    return float(right.float().mean()) if right.numel() else None
