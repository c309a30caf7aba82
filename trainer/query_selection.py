"""Query selection: which M of the candidate pairs are asked (paper, section 4.2; appendix B)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType

import numpy as np
import torch
from torch import Tensor

from labels_db.run_config import (
    Disagreement,
    Entropy,
    InstalledScheme,
    KCenter,
    KCenterDisagreement,
    KCenterEntropy,
    SchemeConfig,
    Uniform,
)
from trainer import extensions
from trainer.candidate_scores import disagreement, entropy, pair_probabilities
from trainer.extensions import installed
from trainer.reward_model import RewardModel
from trainer.segments import Pair, PairSampler


@dataclass(frozen=True)
class Chosen:
    """A pair to ask, the scheme that chose it and its score under that scheme."""

    pair: Pair
    scheme: str
    score: float | None


@dataclass(frozen=True)
class Selection:
    """M pairs are wanted; `candidates_per_query` times as many may be looked at."""

    sampler: PairSampler
    model: RewardModel
    count: int
    candidates_per_query: int
    asked: Callable[[], Tensor]
    """Both segments' observations of every preference so far, [n, 2·H·D]."""

    def candidates(self) -> list[Pair]:
        return self.sampler.draw(self.count * self.candidates_per_query)


Picked = list[tuple[Pair, float | None]]
Scheme = Callable[[Selection], Picked]
Score = Callable[[Tensor], Tensor]
"""Each member's P[σ¹ ≻ σ⁰] of n candidates, [E, n] → [n]."""


def uniform(wanted: Selection) -> Picked:
    """Random pairs."""
    return [(pair, None) for pair in wanted.sampler.draw(wanted.count)]


def highest(score: Score, wanted: Selection) -> Picked:
    """The candidates with the highest score."""
    return _by_score(score, wanted.candidates(), wanted.model, wanted.count)


def farthest(wanted: Selection) -> Picked:
    """Greedy k-center: each one the candidate farthest from D's pairs and from those chosen before it."""
    return _farthest_of(wanted.candidates(), wanted)


def farthest_of_better_half(score: Score, wanted: Selection) -> Picked:
    """k-center among the half of the candidates that scores higher."""
    pairs = wanted.candidates()
    half = _by_score(score, pairs, wanted.model, max(wanted.count, len(pairs) // 2))
    return _farthest_of([pair for pair, _ in half], wanted)


SCHEMES: MappingProxyType[type, Scheme] = MappingProxyType(
    {
        Uniform: uniform,
        Disagreement: partial(highest, disagreement),
        Entropy: partial(highest, entropy),
        KCenter: farthest,
        KCenterDisagreement: partial(farthest_of_better_half, disagreement),
        KCenterEntropy: partial(farthest_of_better_half, entropy),
    }
)


def scheme_of(config: SchemeConfig) -> Scheme:
    """The configured scheme; ValueError where no installed package offers it."""
    if isinstance(config, InstalledScheme):
        scheme: Scheme = installed(extensions.SCHEMES, config.name)
        return scheme
    return SCHEMES[type(config)]


def select(scheme: SchemeConfig, wanted: Selection) -> list[Chosen]:
    """The pairs that the scheme asks."""
    return [Chosen(pair, scheme.kind, score) for pair, score in scheme_of(scheme)(wanted)]


def _by_score(score: Score, pairs: list[Pair], model: RewardModel, count: int) -> Picked:
    scores = score(pair_probabilities(model, pairs)).cpu().numpy()
    best = np.argsort(-scores, kind="stable")[:count]
    return [(pairs[row], float(scores[row])) for row in best]


def _farthest_of(pairs: list[Pair], wanted: Selection) -> Picked:
    """The score of each is its distance to the nearest at the moment it was chosen."""
    places = torch.from_numpy(np.stack([_place(pair) for pair in pairs])).to(wanted.model.device)
    asked = wanted.asked()
    nearest = places.new_full((len(pairs),), torch.inf)
    if len(asked):
        nearest = torch.cdist(places, asked).amin(1)
    picked: Picked = []
    for _ in range(min(wanted.count, len(pairs))):
        row = int(nearest.argmax())
        picked.append((pairs[row], float(nearest[row]) if nearest[row].isfinite() else None))
        nearest = torch.minimum(nearest, (places - places[row]).norm(dim=1))
        nearest[row] = -1.0
    return picked


def _place(pair: Pair) -> np.ndarray[tuple[int], np.dtype[np.float32]]:
    """Both segments' observations, [2·H·D]."""
    return np.concatenate([segment.observations.ravel() for segment in pair]).astype(np.float32)
