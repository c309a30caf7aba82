"""Segments are what was lived, and a pair never overlaps."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trainer.episodes import EpisodePool, FinishedEpisode
from trainer.segments import PairSampler, inputs_from_bytes


def episode(number: int, length: int) -> FinishedEpisode:
    rng = np.random.default_rng(number)
    return FinishedEpisode(
        number=number,
        seed=100 + number,
        policy_step=number * 10,
        observations=rng.normal(size=(length, 3)).astype(np.float32),
        actions=rng.normal(size=(length, 2)).astype(np.float32),
        rewards=rng.normal(size=length).astype(np.float32),
        states=rng.normal(size=(length, 2, 4)),
    )


def pool_of(*lengths: int) -> EpisodePool:
    pool = EpisodePool(20)
    for number, length in enumerate(lengths):
        pool.add(episode(number, length))
    return pool


@given(
    st.lists(st.integers(1, 30), min_size=1, max_size=5),
    st.integers(1, 12),
    st.integers(0, 100),
)
def test_pairs_are_whole_and_disjoint_whenever_there_are_any(lengths: list[int], h: int, seed: int) -> None:
    sampler = PairSampler(pool_of(*lengths), h, np.random.default_rng(seed))
    long_enough = [length for length in lengths if length >= h]
    assert sampler.can_draw() == (len(long_enough) > 1 or any(length >= 2 * h for length in lengths))
    if not sampler.can_draw():
        return
    for first, second in sampler.draw(20):
        for segment in (first, second):
            assert 0 <= segment.start <= len(segment.episode) - h
            assert segment.states.shape == (h, 2, 4)
            np.testing.assert_array_equal(segment.moments[1::2], segment.states[:, 1])
        if first.episode is second.episode:
            assert abs(first.start - second.start) >= h


def test_of_one_episode_every_disjoint_pair_is_drawn_equally_often() -> None:
    (lone,) = (pool_of(9),)
    drawn = Counter((a.start, b.start) for a, b in PairSampler(lone, 4, np.random.default_rng(0)).draw(6000))
    every = {(a, b) for a in range(6) for b in range(6) if abs(a - b) >= 4}
    assert set(drawn) == every
    assert all(abs(count - 6000 / len(every)) < 200 for count in drawn.values())


def test_the_only_pair_of_an_episode_is_found() -> None:
    pairs = PairSampler(pool_of(100), 50, np.random.default_rng(0)).draw(20)
    assert {tuple(sorted((a.start, b.start))) for a, b in pairs} == {(0, 50)}


def test_an_average_segment_earns_its_share_of_the_last_episodes() -> None:
    pool = pool_of(10, 20, 30)
    lived = list(pool.episodes)[1:]
    expected = 5 * sum(float(e.rewards.sum()) for e in lived) / 50
    assert PairSampler(pool, 5, np.random.default_rng(0)).average_return(2) == pytest.approx(
        expected, rel=1e-5
    )


def test_the_last_ten_episodes_count_unless_more_are_asked_for() -> None:
    pool = pool_of(*[10] * 12)
    lived = list(pool.episodes)[2:]
    expected = 5 * sum(float(e.rewards.sum()) for e in lived) / 100
    assert PairSampler(pool, 5, np.random.default_rng(0)).average_return() == pytest.approx(
        expected, rel=1e-5
    )


def test_every_start_is_drawn_the_last_one_too() -> None:
    sampler = PairSampler(pool_of(6, 6), 4, np.random.default_rng(0))
    starts = {segment.start for pair in sampler.draw(200) for segment in pair}
    assert starts == {0, 1, 2}


def test_an_artifact_gives_back_what_the_reward_model_takes() -> None:
    (first, _second), *_ = PairSampler(pool_of(20, 20), 5, np.random.default_rng(0)).draw(1)
    np.testing.assert_array_equal(inputs_from_bytes(first.to_bytes()), first.inputs)
    assert first.inputs.shape == (5, 5)
    expected = first.episode.rewards[first.start : first.start + 5].sum()
    assert first.true_return == pytest.approx(expected, rel=1e-6)
