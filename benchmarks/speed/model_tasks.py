"""Units of work of the reward model: fits, relabelling, selection."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import torch

from benchmarks.speed.work import ACTION, CPU, OBSERVATION, PRECISIONS, Work, as_pytorch_comes
from labels_db.run_config import Disagreement, Entropy, LearnedReward, SchemeConfig
from trainer.candidate_scores import disagreement, entropy
from trainer.episodes import EpisodePool, FinishedEpisode
from trainer.query_selection import Selection, select
from trainer.randomness import Randomness
from trainer.replay_buffer import ReplayBuffer
from trainer.reward_model import Preferences, RewardModel
from trainer.segments import PairSampler


class PlainRewardModel(RewardModel):
    """The same under autograd, whole minibatches at a time."""

    def member_rewards(self, inputs: torch.Tensor) -> torch.Tensor:
        with torch.no_grad():
            return torch.tanh(
                torch.cat([self.members(rows)[..., 0] for rows in torch.split(inputs, 10_000)], 1)
            )

    def _learn(self, preferences: Preferences, rows: torch.Tensor) -> torch.Tensor:
        label, sums = preferences.label[rows], []
        with torch.enable_grad():
            for segments in (preferences.first[rows], preferences.second[rows]):
                rewards = torch.tanh(self.members(segments.flatten(1, 2))[..., 0])
                sums.append(rewards.view(*segments.shape[:3]).sum(-1))
            logit = sums[1] - sums[0]
            loss = torch.nn.functional.binary_cross_entropy_with_logits(logit, label, reduction="none")
            self.optimizer.clear()
            torch.autograd.backward(loss.mean(1).sum())
        self.optimizer.step()
        return ((logit.detach() > 0) == (label > 0.5))[label != 0.5]


def _model(precision: str, plain: bool, **changes: Any) -> RewardModel:
    kind = PlainRewardModel if plain else RewardModel
    if plain:
        as_pytorch_comes()
    config = LearnedReward(stop_accuracy=1.0, **changes)
    return kind(config, OBSERVATION, ACTION, Randomness(0), CPU, PRECISIONS[precision])


def fit(labels: int = 700, precision: str = "float32", plain: bool = False) -> Work:
    """One epoch over all labels of 2 × 50 steps, 3 members."""
    generator = torch.Generator().manual_seed(0)
    first, second = (torch.randn(labels, 50, OBSERVATION + ACTION, generator=generator) for _ in range(2))
    label = (second[..., 0].sum(-1) > first[..., 0].sum(-1)).float()
    model = _model(precision, plain, max_epochs=1)
    return lambda: model.fit(Preferences(first, second, label))


def relabel(rows: int, precision: str = "float32", plain: bool = False) -> Work:
    """Every reward of a buffer anew."""
    buffer, model = ReplayBuffer(rows, OBSERVATION, ACTION), _model(precision, plain)
    buffer.added = rows
    buffer.table.normal_()
    return lambda: buffer.relabel(model)


SCHEMES: dict[str, tuple[SchemeConfig, Callable[[torch.Tensor], torch.Tensor]]] = {
    "entropy": (Entropy(), entropy),
    "disagreement": (Disagreement(), disagreement),
}


def choose(
    count: int = 140, scheme: str = "entropy", precision: str = "float32", plain: bool = False
) -> Work:
    """The best `count` pairs out of ten times as many, from 100 episodes of 1000 steps."""
    pool, rng = EpisodePool(100), np.random.default_rng(0)
    for number in range(100):
        columns = [rng.normal(size=(1000, n)).astype(np.float32) for n in (OBSERVATION, ACTION, 1)]
        pool.add(FinishedEpisode(number, 0, 0, columns[0], columns[1], columns[2][:, 0], columns[0]))
    sampler, model = PairSampler(pool, 50, rng), _model(precision, plain)
    config, score = SCHEMES[scheme]
    if not plain:
        wanted = Selection(sampler, model, count, 10, lambda: torch.empty(0, 0))
        return lambda: select(config, wanted)

    def each_by_itself() -> torch.Tensor:
        pairs = sampler.draw(10 * count)
        sides = [torch.from_numpy(np.stack([pair[side].inputs for pair in pairs])) for side in (0, 1)]
        return score(model.probabilities(sides[0], sides[1])).topk(count).indices

    return each_by_itself
