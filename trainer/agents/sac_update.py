"""What an update of soft actor-critic is, and what it says of itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from torch import Tensor

from trainer.replay_buffer import Batch


@dataclass(frozen=True)
class SACLosses:
    """Kept as tensors until somebody reads them: most updates nobody asks about."""

    error: Tensor
    """Q − y of both critics, [2, B]."""
    values: Tensor
    """Q of the actions sampled for the actor, [2, B]."""
    log_prob: Tensor
    """log π of those actions, [B]."""
    temperature: Tensor
    """α after its step."""
    rewards: Tensor
    """What was learned from, [B]."""

    def read(self) -> dict[str, float]:
        """The losses by name; on a GPU this waits."""
        soft = self.temperature * self.log_prob - self.values.amin(0)
        return {
            "critic_loss": float(self.error.square().mean(1).sum()),
            "actor_loss": float(soft.mean()),
            "entropy": -float(self.log_prob.mean()),
            "temperature": float(self.temperature),
            "batch_reward": float(self.rewards.mean()),
        }


class Update(Protocol):
    """Steps an agent's critics, then its actor and temperature."""

    def __call__(self, batch: Batch, rewards: Tensor, noise: Tensor) -> SACLosses:
        """`rewards` [B]; `noise` [2, B, A] is standard normal, for the next and for the present actions."""

    def refresh(self) -> None:
        """All networks have changed from outside."""

    def target_moved(self) -> None:
        """The target critics have followed."""
