"""Query selection: which M of the candidate pairs are asked (paper, section 4.2; appendix B)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from labels_db.run_config import Disagreement, Entropy, SchemeConfig, Uniform
from trainer.reward_model import RewardModel
from trainer.segments import Pair, PairSampler, stack_inputs


@dataclass(frozen=True)
class Chosen:
    """A pair to ask, the scheme that chose it and its score under that scheme."""

    pair: Pair
    scheme: str
    score: float | None


def disagreement(probabilities: Tensor) -> Tensor:
    """Standard deviation over members of P[σ¹ ≻ σ⁰], [E, n] → [n]."""
    return probabilities.std(0, correction=0)


def entropy(probabilities: Tensor) -> Tensor:
    """Mean over members of each one's binary entropy in nats, [E, n] → [n]."""
    each: Tensor = torch.special.entr(probabilities) + torch.special.entr(1 - probabilities)
    return each.mean(0)


SCORES: dict[type, Callable[[Tensor], Tensor] | None] = {
    Uniform: None,
    Disagreement: disagreement,
    Entropy: entropy,
}


def select(
    scheme: SchemeConfig, sampler: PairSampler, model: RewardModel, count: int, candidates_per_query: int
) -> list[Chosen]:
    """`count` pairs: random ones, or the highest-scored of `candidates_per_query` times as many."""
    score = SCORES[type(scheme)]
    if score is None:
        return [Chosen(pair, scheme.kind, None) for pair in sampler.draw(count)]
    pairs = sampler.draw(count * candidates_per_query)
    first, second = (stack_inputs([pair[side] for pair in pairs]).to(model.device) for side in (0, 1))
    scores = score(model.probabilities(first, second)).cpu().numpy()
    best = np.argsort(-scores, kind="stable")[:count]
    return [Chosen(pairs[row], scheme.kind, float(scores[row])) for row in best]
