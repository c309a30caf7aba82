"""The paper's formulas, each against a recomputation by hand."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from labels_db.run_config import SAC, LearnedReward, StateEntropy
from tests.trainer.given import lived, preference_loss, remember
from trainer.agents.sac import SACAgent
from trainer.agents.sac_by_hand import UpdateByHand
from trainer.candidate_scores import disagreement, entropy
from trainer.exploration import RunningDeviation, StateEntropyReward
from trainer.neighbours import neighbour_distance
from trainer.networks import Actor, tanh_gaussian_log_prob
from trainer.randomness import Randomness
from trainer.replay_buffer import Batch, ReplayBuffer
from trainer.reward_model import Preferences, RewardModel, preference_logit

CPU = torch.device("cpu")


def reward_model(**changes: float) -> RewardModel:
    config = LearnedReward(width=8, **changes)
    return RewardModel(config, 3, 2, Randomness(0), CPU)


def by_hand(model: RewardModel, member: int, inputs: torch.Tensor) -> torch.Tensor:
    """One member's reward, layer by layer: LeakyReLU(0.01) between, tanh at the end."""
    x = inputs
    layers = model.members.layers(model.members.flat.detach())
    for index, (weight, bias) in enumerate(layers):
        x = x @ weight[member] + bias[member]
        x = torch.where(x > 0, x, 0.01 * x) if index < len(layers) - 1 else torch.tanh(x)
    return x[..., 0]


def test_preference_probability_is_the_softmax_of_segment_sums() -> None:
    model = reward_model()
    first, second = torch.randn(4, 7, 5), torch.randn(4, 7, 5)
    found = model.probabilities(first, second)
    for member in range(3):
        sums = [by_hand(model, member, segment).sum(-1) for segment in (first, second)]
        expected = sums[1].exp() / (sums[0].exp() + sums[1].exp())
        torch.testing.assert_close(found[member], expected)


@pytest.mark.parametrize("label", [0.0, 0.25, 0.5, 1.0])
@pytest.mark.parametrize("smoothing", [0.0, 0.1])
def test_loss_is_the_cross_entropy_with_soft_labels(label: float, smoothing: float) -> None:
    first, second = torch.tensor([[1.3]]), torch.tensor([[0.4]])
    p_second = math.exp(0.4) / (math.exp(1.3) + math.exp(0.4))
    y = label * (1 - smoothing) + smoothing / 2
    expected = -(1 - y) * math.log(1 - p_second) - y * math.log(p_second)
    loss = preference_loss(preference_logit(first, second), torch.tensor([label]), smoothing)
    assert loss.item() == pytest.approx(expected, rel=1e-6)


def test_the_learned_reward_is_the_plain_mean_of_its_members() -> None:
    model = reward_model()
    observation, action = torch.randn(6, 3), torch.randn(6, 2)
    inputs = torch.cat([observation, action], -1)
    expected = torch.stack([by_hand(model, member, inputs) for member in range(3)]).mean(0)
    torch.testing.assert_close(model(inputs), expected)


def test_one_step_of_a_fit_is_adam_on_each_members_own_cross_entropy() -> None:
    model = reward_model(batch_size=4)
    preferences = Preferences(torch.randn(4, 7, 5), torch.randn(4, 7, 5), torch.tensor([0.0, 1.0, 0.5, 1.0]))
    before = [part.detach().clone() for layer in model.members.layers() for part in layer]
    rows = torch.stack([torch.arange(4)] * 3)
    model._learn(preferences, rows)
    shadow = [p.clone().requires_grad_() for p in before]
    loss = torch.zeros(())
    for m in range(3):
        x = [preferences.first, preferences.second]
        sums = []
        for segments in x:
            h = segments
            for index in range(0, len(shadow), 2):
                h = h @ shadow[index][m] + shadow[index + 1][m]
                h = torch.where(h > 0, h, 0.01 * h) if index < len(shadow) - 2 else torch.tanh(h)
            sums.append(h[..., 0].sum(-1))
        p = torch.sigmoid(sums[1] - sums[0])
        y = preferences.label
        loss = loss + (-(1 - y) * (1 - p).log() - y * p.log()).mean()
    optimizer = torch.optim.Adam(shadow, lr=3e-4)
    loss.backward()  # type: ignore[no-untyped-call]
    optimizer.step()
    after = [part for layer in model.members.layers() for part in layer]
    for now, expected in zip(after, shadow, strict=True):
        torch.testing.assert_close(now.detach(), expected.detach(), rtol=1e-4, atol=1e-6)


def test_disagreement_and_entropy_by_hand() -> None:
    p = np.array([[0.9, 0.5], [0.2, 0.5], [0.7, 0.5]])
    spread = disagreement(torch.tensor(p)).numpy()
    np.testing.assert_allclose(spread, p.std(axis=0))
    each = -(p * np.log(p) + (1 - p) * np.log(1 - p))
    np.testing.assert_allclose(entropy(torch.tensor(p)).numpy(), each.mean(axis=0))
    assert float(entropy(torch.tensor([[0.0], [1.0]]))) == 0.0  # certain, not "not a number"


@settings(max_examples=30, deadline=None)
@given(count=st.integers(2, 30), k=st.integers(1, 8), seed=st.integers(0, 1000))
def test_neighbour_distance_against_sorting(count: int, k: int, seed: int) -> None:
    states = torch.randn(count, 3, generator=torch.Generator().manual_seed(seed))
    rows = torch.tensor([0, count - 1, count // 2])
    found = neighbour_distance(states[rows], rows, states, k).numpy()
    for row, distance in zip(rows.tolist(), found, strict=True):
        others = np.delete(states.numpy(), row, axis=0)
        expected = np.sort(np.linalg.norm(others - states.numpy()[row], axis=1))[min(k, count - 1) - 1]
        assert distance == pytest.approx(expected, rel=1e-5)


def test_a_state_stored_twice_is_its_own_neighbour_but_never_itself() -> None:
    states = torch.tensor([[0.0], [0.0], [3.0], [5.0]])
    rows = torch.tensor([0, 2])
    np.testing.assert_allclose(neighbour_distance(states[rows], rows, states, 1).numpy(), [0.0, 2.0])


@settings(max_examples=30, deadline=None)
@given(st.lists(st.lists(st.floats(-100, 100), min_size=1, max_size=6), min_size=1, max_size=8))
def test_running_deviation_equals_that_of_all_values_at_once(parts: list[list[float]]) -> None:
    running = RunningDeviation()
    for part in parts:
        running.update(torch.tensor(part, dtype=torch.float64))
    every = np.concatenate(parts)
    expected = every.std() if every.std() > 0 else 1.0
    if every.std() == 0 or every.std() > 1e-6:
        assert float(running.value) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("transform", ["distance", "log"])
def test_intrinsic_reward_is_divided_but_neither_centred_nor_clipped(transform: str) -> None:
    buffer = ReplayBuffer(10, 1, 1)
    points = torch.tensor([[0.0], [2.0], [5.0], [9.0]])
    zeros = torch.zeros(4, 1)
    remember(buffer, points, zeros, torch.zeros(4), points)
    reward = StateEntropyReward(StateEntropy(neighbours=1, transform=transform), buffer, Randomness(0))
    rows = torch.arange(4)
    batch = Batch(rows, points, zeros, torch.zeros(4), points, torch.ones(4))
    distance = np.array([2.0, 2.0, 3.0, 4.0])
    raw = distance if transform == "distance" else np.log(1e-6 + distance)
    np.testing.assert_allclose(reward(batch).numpy(), raw / raw.std(), rtol=1e-5)


def test_log_probability_of_the_squashed_gaussian_by_change_of_variables() -> None:
    mean, log_std = torch.tensor([[0.3, -0.2]]).double(), torch.tensor([[-0.5, 0.1]]).double()
    before = torch.tensor([[0.8, -1.1]]).double()
    found = float(tanh_gaussian_log_prob(before, mean, log_std))
    expected = 0.0
    for x, m, s in zip(before[0].tolist(), mean[0].tolist(), log_std.exp()[0].tolist(), strict=True):
        density = math.exp(-0.5 * ((x - m) / s) ** 2) / (s * math.sqrt(2 * math.pi))
        expected += math.log(density / (1 - math.tanh(x) ** 2))
    assert found == pytest.approx(expected, rel=1e-9)
    far = tanh_gaussian_log_prob(torch.full((1, 2), 40.0), torch.zeros(1, 2), torch.zeros(1, 2))
    assert torch.isfinite(far).all()  # the naive form takes log 0 here


def test_log_std_stays_in_its_range() -> None:
    actor = Actor(2, 1, 8, 1, torch.Generator().manual_seed(0))
    _, log_std = actor(1e6 * torch.randn(100, 2))
    assert log_std.min() >= -5
    assert log_std.max() <= 2


def agent(**changes: float) -> SACAgent:
    config = SAC(width=8, batch_size=8, **changes)
    return SACAgent(config, 3, 2, 100, Randomness(1), CPU)


def test_target_bootstraps_through_truncation_and_stops_at_termination() -> None:
    learner = agent(discount=0.9)
    rows = torch.arange(4)
    not_terminated = torch.tensor([1.0, 0.0, 1.0, 0.0])
    batch = Batch(
        rows, torch.randn(4, 3), torch.randn(4, 2), torch.zeros(4), torch.randn(4, 3), not_terminated
    )
    rewards = torch.tensor([1.0, 2.0, 3.0, 4.0])
    noise = torch.randn(4, 2)
    update = UpdateByHand(learner, torch.float32)
    with torch.no_grad():
        found = update.target(batch, rewards, update.sample(batch.next_observation, noise))
        action, log_prob = learner.actor.sample(batch.next_observation, noise)
        q1, q2 = learner.target_critic(batch.next_observation, action)
    soft = torch.minimum(q1, q2) - 0.1 * log_prob
    torch.testing.assert_close(found, rewards + 0.9 * not_terminated * soft)
    assert found[1] == 2.0
    assert found[3] == 4.0


def test_target_critics_follow_by_polyak_average_every_second_update() -> None:
    learner = agent(target_rate=0.1)
    for _ in range(20):
        noise = [np.random.default_rng(0).normal(size=(1, n)).astype(np.float32) for n in (3, 2, 3)]
        learner.observe(lived(noise[0], noise[1], noise[2], np.zeros(1, bool)), torch.ones(1))
    start = [p.clone() for p in learner.target_critic.parameters()]
    learner.update()
    for before, now in zip(start, learner.target_critic.parameters(), strict=True):
        torch.testing.assert_close(before, now)
    learner.update()
    for before, now, critic in zip(
        start, learner.target_critic.parameters(), learner.critic.parameters(), strict=True
    ):
        torch.testing.assert_close(now, 0.9 * before + 0.1 * critic)


@settings(max_examples=25, deadline=None)
@given(capacity=st.integers(3, 40), added=st.integers(1, 90), seed=st.integers(0, 100))
def test_relabelling_writes_every_valid_row_also_when_the_ring_has_wrapped(
    capacity: int, added: int, seed: int
) -> None:
    generator = torch.Generator().manual_seed(seed)
    buffer = ReplayBuffer(capacity, 3, 2)
    buffer.RELABEL_ROWS = 7  # several slices even in a small buffer
    for _ in range(added):
        row = [torch.randn(1, n, generator=generator) for n in (3, 2, 3)]
        remember(buffer, row[0], row[1], torch.full((1,), 99.0), row[2])
    model = reward_model()
    model._rows = 3  # nor do the model's own parts end where the buffer's do
    buffer.relabel(model)
    count = min(capacity, added)
    with torch.no_grad():
        plainly = model.members(torch.cat([buffer.observation[:count], buffer.action[:count]], -1))
    expected = torch.tanh(plainly[..., 0]).mean(0)
    torch.testing.assert_close(buffer.reward[:count], expected, rtol=0, atol=1e-6)
    assert len(buffer) == count


@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="Linux tells a process's peak")
@pytest.mark.parametrize("precision", [torch.float32, torch.bfloat16])
def test_relabelling_takes_no_room_of_its_own(precision: torch.dtype) -> None:
    """Under 20 MB however many rows there are: one hidden layer of all of these has 600, or 300 in bfloat16."""
    buffer = ReplayBuffer(200_000, 24, 6)
    buffer.table.normal_()
    buffer.added = 200_000
    first, model = (
        RewardModel(LearnedReward(), 24, 6, Randomness(0), torch.device("cpu"), precision) for _ in range(2)
    )
    first(buffer.inputs[: buffer.RELABEL_ROWS])  # a library's own kernels come with their first use, and stay
    Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
    before = peak_megabytes()
    buffer.relabel(model)
    assert peak_megabytes() - before < 20


def peak_megabytes() -> float:
    """The most memory that this process had resident."""
    (line,) = re.findall(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text())
    return int(line) / 1024


@pytest.mark.parametrize("at_once", [1, 2, 3])
def test_the_ring_keeps_the_latest_rows(at_once: int) -> None:
    buffer = ReplayBuffer(4, 1, 1)
    for values in torch.split(torch.arange(6.0), at_once):
        column = values[:, None]
        remember(buffer, column, column, values, column)
    torch.testing.assert_close(buffer.observation[:, 0], buffer.reward)
    assert sorted(buffer.reward.tolist()) == [2.0, 3.0, 4.0, 5.0]
    assert buffer.added == 6
