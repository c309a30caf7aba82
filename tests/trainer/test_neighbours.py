"""Neighbours found through products of matrices are those of a plain search."""

from __future__ import annotations

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from labels_db.run_config import StateEntropy
from tests.trainer.given import remember
from trainer import neighbours
from trainer.exploration import StateEntropyReward, one_of_each_part
from trainer.nearest_so_far import NearestSoFar
from trainer.neighbours import neighbour_distance, plain_neighbour_distance
from trainer.randomness import Randomness
from trainer.replay_buffer import ReplayBuffer


@settings(max_examples=25, deadline=None)
@given(
    st.integers(300, 1500),
    st.integers(1, 30),
    st.integers(1, 8),
    st.sampled_from(["normal", "twice", "grid", "equal", "far", "nan", "inf"]),
    st.integers(0, 10**6),
)
def test_neighbours_are_those_of_a_plain_search(count: int, size: int, k: int, kind: str, seed: int) -> None:
    generator = torch.Generator().manual_seed(seed)
    states = torch.randn(count, size, generator=generator)
    states = {
        "normal": states,
        "twice": torch.cat([states[: count // 2]] * 2),
        "grid": states.round(),  # many distances alike
        "equal": torch.zeros_like(states) + 7,
        "far": states + 1e4 * (torch.arange(count) % 2)[:, None],  # rounding leaves doubts
        "nan": torch.cat([states, torch.full((1, size), torch.nan)]),
        "inf": torch.cat([states, torch.full((1, size), torch.inf)]),
    }[kind]
    rows = torch.randint(len(states), (150,), generator=generator)  # searched and measured in several parts
    own = torch.where(torch.arange(150) % 3 > 0, rows, -1)  # some are not among the states
    found = neighbour_distance(states[rows], own, states, k)
    expected = plain_neighbour_distance(states[rows], own, states, k)
    torch.testing.assert_close(found, expected, rtol=1e-5, atol=1e-6, equal_nan=True)


def test_more_states_than_are_compared_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(neighbours, "STATES", 256)
    monkeypatch.setattr(neighbours, "QUERIES", 16)
    states = torch.randn(3000, 5, generator=torch.Generator().manual_seed(0))
    rows = torch.arange(2960, 3000)
    found = neighbour_distance(states[rows], rows, states, 5)
    torch.testing.assert_close(found, plain_neighbour_distance(states[rows], rows, states, 5))


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.integers(1, 400), min_size=1, max_size=8),
    st.integers(1, 30),
    st.integers(1, 8),
    st.sampled_from(["normal", "grid", "nan"]),
    st.integers(0, 10**6),
)
def test_what_is_known_of_states_grows_with_the_buffer(
    added: list[int], size: int, k: int, kind: str, seed: int
) -> None:
    """To the bit what a search of all states finds: a resumed run knows nothing of them, and must go on alike."""
    generator = torch.Generator().manual_seed(seed)
    states = torch.randn(sum(added), size, generator=generator)
    states = {"normal": states, "grid": states.round(), "nan": states.where(states < 3, torch.nan)}[kind]
    known = NearestSoFar(k)
    for count in torch.tensor(added).cumsum(0).tolist():
        for _ in range(2):
            rows = torch.randint(count, (150,), generator=generator)
            found = known.distance(rows, states[:count])
            assert torch.equal(
                found.nan_to_num(-1), NearestSoFar(k).distance(rows, states[:count]).nan_to_num(-1)
            )
            expected = plain_neighbour_distance(states[rows], rows, states[:count], k)
            torch.testing.assert_close(found, expected, rtol=1e-5, atol=1e-6, equal_nan=True)


def test_a_ring_that_has_come_round_is_searched_anew() -> None:
    buffer = ReplayBuffer(400, 2, 1)
    reward = StateEntropyReward(StateEntropy(), buffer, Randomness(0))
    generator = torch.Generator().manual_seed(0)
    for _ in range(7):
        states, zeros = torch.randn(100, 2, generator=generator), torch.zeros(100, 1)
        remember(buffer, states, zeros, zeros[:, 0], states)
        batch = buffer.sample(64, generator)
        found = reward._distance(batch)
        expected = plain_neighbour_distance(batch.observation, batch.rows, buffer.observations(), 5)
        torch.testing.assert_close(found, expected)


def test_doubts_are_searched_plainly(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []

    def counted(*args: torch.Tensor) -> torch.Tensor:
        asked.append(len(args[0]))
        return every(*args)  # type: ignore[arg-type]

    every = neighbours._nearest_of_all
    monkeypatch.setattr(neighbours, "_nearest_of_all", counted)
    states = torch.randn(2000, 4, generator=torch.Generator().manual_seed(0))
    rows = torch.arange(20)
    assert len(rows) * len(states) > neighbours.FEW
    neighbour_distance(states[rows], rows, states, 5)
    assert asked == []
    states[1000] += 1e6
    neighbour_distance(states[rows], rows, states, 5)
    assert asked == []  # one far away leaves no doubt about the others
    states[1000:] += 1e5
    rows += 1980  # themselves far from the middle, and near each other
    neighbour_distance(states[rows], rows, states, 5)
    assert sum(asked) > 0


@given(st.integers(1, 300), st.integers(1, 60), st.integers(0, 1000))
def test_a_row_of_each_part_comes_once_and_any_may_come(parts: int, more: int, seed: int) -> None:
    count = parts + more
    generator = torch.Generator().manual_seed(seed)
    drawn = torch.stack([one_of_each_part(count, parts, generator) for _ in range(3)])
    assert (drawn.diff(dim=1) > 0).all()
    assert 0 <= int(drawn.min()) <= int(drawn.max()) < count


@pytest.mark.parametrize(("count", "parts"), [(10, 4), (10, 8), (10, 10)])
def test_every_row_is_drawn_equally_often(count: int, parts: int) -> None:
    generator = torch.Generator().manual_seed(0)
    drawn = torch.cat([one_of_each_part(count, parts, generator) for _ in range(4000)])
    share = torch.bincount(drawn, minlength=count) / 4000
    assert torch.allclose(share, torch.full((count,), parts / count), atol=0.04)


def test_states_compared_bounds_the_search_and_leaves_out_the_state_itself() -> None:
    buffer = ReplayBuffer(1000, 2, 1)
    states = torch.randn(1000, 2, generator=torch.Generator().manual_seed(0))
    zeros = torch.zeros(1000, 1)
    remember(buffer, states, zeros, zeros[:, 0], states)
    reward = StateEntropyReward(StateEntropy(states_compared=200), buffer, Randomness(0))
    batch = buffer.sample(64, torch.Generator().manual_seed(1))
    compared, own = reward._compared(batch)
    assert len(compared) == 200
    inside = own >= 0
    assert 0 < inside.sum() < 64
    torch.testing.assert_close(compared[own[inside]], batch.observation[inside])
    assert (compared[None] == batch.observation[~inside][:, None]).all(-1).sum() == 0
    assert (reward(batch) > 0).all()
