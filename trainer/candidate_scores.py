"""How much is to be learned from asking a candidate pair, by what the ensemble's members say of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from trainer.reward_model import RewardModel, preference_logit
from trainer.segments import Pair, SegmentData


def disagreement(probabilities: Tensor) -> Tensor:
    """Standard deviation over members of P[σ¹ ≻ σ⁰], [E, n] → [n]."""
    return probabilities.std(0, correction=0)


def entropy(probabilities: Tensor) -> Tensor:
    """Mean over members of each one's binary entropy in nats, [E, n] → [n]."""
    each: Tensor = torch.special.entr(probabilities) + torch.special.entr(1 - probabilities)
    return each.mean(0)


def pair_probabilities(model: RewardModel, pairs: Sequence[Pair]) -> Tensor:
    """Each member's P[σ¹ ≻ σ⁰] of candidate pairs, [E, n].

    Candidates overlap, so each step they cover is scored once; a segment's sum is then the difference of two
    running sums.
    """
    segments = [segment for pair in pairs for segment in pair]
    sums = segment_sums(model, segments).view(-1, len(pairs), 2)
    return torch.sigmoid(preference_logit(sums[..., 0], sums[..., 1]))


def segment_sums(model: RewardModel, segments: Sequence[SegmentData]) -> Tensor:
    """Each member's undiscounted sum over each segment, [E, n]; running sums in double precision."""
    episodes = {segment.episode.number: segment.episode for segment in segments}
    lengths = [len(episode) for episode in episodes.values()]
    begins = dict(zip(episodes, np.cumsum([0, *lengths]).tolist(), strict=False))
    starts = np.array([begins[segment.episode.number] + segment.start for segment in segments])
    ends = starts + [segment.length for segment in segments]
    covered = np.flatnonzero(
        np.cumsum(
            np.bincount(starts, minlength=sum(lengths) + 1) - np.bincount(ends, minlength=sum(lengths) + 1)
        )
    )
    steps = [np.concatenate([e.observations, e.actions], -1, dtype=np.float32) for e in episodes.values()]
    inputs = torch.from_numpy(np.concatenate(steps)[covered]).to(model.device)
    rewards = inputs.new_zeros(model.config.members, sum(lengths) + 1, dtype=torch.float64)
    rewards[:, torch.from_numpy(covered).to(model.device) + 1] = model.member_rewards(inputs).double()
    running = rewards.cumsum(1)
    return (running[:, ends] - running[:, starts]).float()
