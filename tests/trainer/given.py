"""What several tests of the trainer begin with."""

from __future__ import annotations

import numpy as np
import torch.nn.functional as F  # noqa: N812  (PyTorch's own convention)
from numpy.typing import NDArray
from torch import Tensor

from trainer.collector import Transitions
from trainer.replay_buffer import ReplayBuffer
from trainer.reward_model import smoothed

Array = NDArray[np.float32]


def lived(
    observations: Array, actions: Array, next_observations: Array, terminated: NDArray[np.bool_]
) -> Transitions:
    """One step of N environments."""
    zeros = np.zeros(len(actions), np.float32)
    return Transitions(
        observations, actions, zeros, next_observations, terminated, ended=terminated, episode_returns=()
    )


def remember(
    buffer: ReplayBuffer, observation: Tensor, action: Tensor, reward: Tensor, following: Tensor
) -> None:
    """Append N transitions that end nothing, given as [N, …]."""
    goes_on = np.zeros(len(reward), bool)
    buffer.remember(lived(observation.numpy(), action.numpy(), following.numpy(), goes_on), reward)


def preference_loss(logit: Tensor, label: Tensor, smoothing: float = 0.0) -> Tensor:
    """Cross-entropy with soft targets (equation 4), each pair's: [E, n] and [n] → [E, n]."""
    soft = smoothed(label, smoothing).expand_as(logit)
    return F.binary_cross_entropy_with_logits(logit, soft, reduction="none")
