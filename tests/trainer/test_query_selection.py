"""Which of the candidates are asked: held against looking at every candidate plainly."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import torch
from torch import Tensor

from labels_db.run_config import (
    Disagreement,
    Entropy,
    KCenter,
    KCenterDisagreement,
    KCenterEntropy,
    LearnedReward,
    SchemeConfig,
    Sessions,
    Uniform,
)
from tests.trainer.test_segments import pool_of
from trainer.asking_rules import EveryKSteps
from trainer.candidate_scores import disagreement, entropy
from trainer.query_selection import SCHEMES, Chosen, Selection, select
from trainer.randomness import Randomness
from trainer.reward_model import RewardModel
from trainer.segments import Pair, PairSampler

COUNT, STEPS = 4, 5


def model() -> RewardModel:
    made = RewardModel(LearnedReward(width=16), 3, 2, Randomness(0), torch.device("cpu"))
    with torch.no_grad():
        made.members.flat.mul_(4)
    return made


def sampler() -> PairSampler:
    return PairSampler(pool_of(30, 30, 30), STEPS, np.random.default_rng(1))


def chosen_by(scheme: SchemeConfig, asked: Tensor | None = None) -> list[Chosen]:
    known = torch.empty(0, 0) if asked is None else asked
    return select(scheme, Selection(sampler(), model(), COUNT, 10, lambda: known))


def scores(score: Callable[[Tensor], Tensor], pairs: list[Pair]) -> Tensor:
    sides = [torch.from_numpy(np.stack([pair[side].inputs for pair in pairs])) for side in (0, 1)]
    return score(model().probabilities(sides[0], sides[1]))


def place(pair: Pair) -> Tensor:
    return torch.from_numpy(np.concatenate([s.observations.ravel() for s in pair]).astype(np.float32))


@pytest.mark.parametrize("scheme", [config() for config in SCHEMES], ids=lambda scheme: scheme.kind)
def test_every_scheme_asks_as_many_different_pairs_as_are_wanted(scheme: SchemeConfig) -> None:
    chosen = chosen_by(scheme)
    assert [c.scheme for c in chosen] == [scheme.kind] * COUNT
    pairs = [[(s.episode.number, s.start) for s in c.pair] for c in chosen]
    assert len({str(pair) for pair in pairs}) == COUNT


def test_uniform_scores_nothing() -> None:
    assert [c.score for c in chosen_by(Uniform())] == [None] * COUNT


@pytest.mark.parametrize(("scheme", "score"), [(Disagreement(), disagreement), (Entropy(), entropy)])
def test_the_best_of_ten_times_as_many_are_kept(
    scheme: SchemeConfig, score: Callable[[Tensor], Tensor]
) -> None:
    best = scores(score, sampler().draw(10 * COUNT)).topk(COUNT).values
    assert [c.score for c in chosen_by(scheme)] == pytest.approx(best.tolist(), rel=1e-5)


@pytest.mark.parametrize(
    ("scheme", "score"),
    [(KCenter(), None), (KCenterDisagreement(), disagreement), (KCenterEntropy(), entropy)],
    ids=lambda value: getattr(value, "kind", ""),
)
def test_k_center_takes_the_farthest_from_what_was_asked_and_chosen(
    scheme: SchemeConfig, score: Callable[[Tensor], Tensor] | None
) -> None:
    pairs = sampler().draw(10 * COUNT)
    asked = torch.stack([place(pair) for pair in pairs[:3]]) + 0.1
    if score is not None:
        pairs = [pairs[row] for row in scores(score, pairs).argsort(descending=True)[: 5 * COUNT]]
    centres = list(asked)
    for found in chosen_by(scheme, asked):
        distances = [min(float((place(pair) - centre).norm()) for centre in centres) for pair in pairs]
        assert found.score == pytest.approx(max(distances), rel=1e-4)
        assert float((place(found.pair) - place(pairs[int(np.argmax(distances))])).norm()) == 0
        centres.append(place(found.pair))


def test_k_center_begins_with_any_pair_while_nothing_has_been_asked() -> None:
    first, *others = chosen_by(KCenter())
    assert first.score is None
    assert all(other.score for other in others)


def test_a_schedule_rounds_down_but_not_its_own_rounding() -> None:
    config = Sessions.model_validate({"schedule": "decreasing", "queries_per_session": 100})
    assert EveryKSteps(config, last_step=500_000).queries(210_000) == 58  # 100 · 0.58 is 57.99… in binary


@pytest.mark.parametrize(
    ("schedule", "expected"),
    [
        ("constant", {0: 20, 500: 20, 990: 20}),
        ("decreasing", {0: 20, 500: 10, 990: 1}),
        ("increasing", {1: 20, 501: 40, 990: 1818}),
    ],
)
def test_a_schedule_changes_how_much_a_session_asks(schedule: str, expected: dict[int, int]) -> None:
    config = Sessions.model_validate({"schedule": schedule, "queries_per_session": 20, "steps_between": 100})
    rule = EveryKSteps(config, last_step=1000)
    assert {step: rule.queries(step) for step in expected} == expected
    assert rule.capacity(800) == rule.queries(800) + rule.queries(900)
