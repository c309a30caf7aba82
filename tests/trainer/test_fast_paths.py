"""What is done by hand for speed equals what is done plainly: gradients, updates, scores."""

from __future__ import annotations

from collections.abc import Callable
from operator import attrgetter

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from labels_db.run_config import SAC, LearnedReward
from tests.trainer.given import lived, preference_loss
from tests.trainer.test_segments import pool_of
from trainer.adam import FlatAdam
from trainer.agents.sac import SACAgent
from trainer.agents.sac_autograd import AutogradUpdate
from trainer.agents.sac_by_hand import UpdateByHand
from trainer.agents.sac_update import Update
from trainer.candidate_scores import pair_probabilities
from trainer.networks import EnsembleMLP, linear_default, orthogonal
from trainer.passes import Passes, Room
from trainer.randomness import Randomness
from trainer.reward_model import Preferences, RewardModel, preference_logit
from trainer.segments import PairSampler

CPU = torch.device("cpu")
shapes = st.tuples(st.integers(1, 4), st.integers(1, 9), st.lists(st.integers(1, 20), min_size=1, max_size=3))


def relative(found: torch.Tensor, expected: torch.Tensor) -> float:
    """The largest difference, relative to the largest number."""
    return float((found - expected).abs().max() / expected.abs().max().clamp(min=1e-30))


def network(
    members: int, sizes: list[int], slope: float, seed: int, *, normalised: bool = False
) -> EnsembleMLP:
    generator = torch.Generator().manual_seed(seed)
    return EnsembleMLP(members, sizes, slope, linear_default, generator, normalised=normalised)


@settings(max_examples=60, deadline=None)
@given(
    shapes,
    st.integers(1, 4),
    st.integers(1, 30),
    st.sampled_from([0.0, 0.01]),
    st.booleans(),
    st.integers(0, 10**6),
)
def test_passes_by_hand_equal_autograd(
    shape: tuple[int, int, list[int]], outputs: int, rows: int, slope: float, normalised: bool, seed: int
) -> None:
    members, inputs, widths = shape
    if normalised:
        widths = [4 + width for width in widths]  # of a unit or two, normalised, only rounding is left
    net = network(members, [inputs, *widths, outputs], slope, seed, normalised=normalised)
    generator = torch.Generator().manual_seed(seed)
    x = torch.randn(rows, inputs, generator=generator).requires_grad_()
    above = torch.randn(members, rows, outputs, generator=generator)
    expected = net(x)
    by_input, by_weight = torch.autograd.grad(expected, [x, net.flat], above)
    passes = Passes(net, torch.float32, Room(CPU))
    with torch.no_grad():
        torch.testing.assert_close(passes.forward(x.detach()), expected.detach(), rtol=1e-5, atol=1e-6)
        delta = passes.backward(above)
        assert relative(passes.gradient, by_weight) < 1e-5
        assert relative(passes.input_gradient(delta, slice(None)).sum(0), by_input) < 1e-5


@pytest.mark.parametrize("normalised", [False, True])
def test_a_backward_pass_may_be_about_the_last_rows_only(normalised: bool) -> None:
    net = network(1, [4, 8, 8, 2], 0.0, 0, normalised=normalised)
    torch.manual_seed(0)
    x, above = torch.randn(10, 4), torch.randn(1, 6, 2)
    (expected,) = torch.autograd.grad(net(x[4:]), [net.flat], above)
    passes = Passes(net, torch.float32, Room(CPU))
    for _ in range(2):  # what the first one remembers of its rows is not taken for the second's
        passes.forward(torch.randn(10, 4))
        passes.backward(above)
    with torch.no_grad():
        passes.forward(x)
        passes.backward(above)
    assert relative(passes.gradient, expected) < 1e-5


def test_passes_in_one_room_overwrite_each_other_and_those_in_two_do_not() -> None:
    net = network(2, [3, 8, 1], 0.0, 0)
    torch.manual_seed(0)
    x, other, above = torch.randn(5, 3), torch.randn(5, 3), torch.randn(2, 5, 1)
    (expected,) = torch.autograd.grad(net(x), [net.flat], above)
    room = Room(CPU)
    for neighbour_room, alike in ((room, False), (Room(CPU), True)):
        mine, neighbour = Passes(net, torch.float32, room), Passes(net, torch.float32, neighbour_room)
        mine.forward(x)
        neighbour.forward(other)
        mine.backward(above)
        assert (relative(mine.gradient, expected) < 1e-5) == alike


@pytest.mark.parametrize("normalised", [False, True])
@pytest.mark.parametrize("slope", [0.0, 0.01])
def test_rounded_products_stay_close(slope: float, normalised: bool) -> None:
    generator = torch.Generator().manual_seed(0)
    net = EnsembleMLP(2, [30, 64, 64, 1], slope, orthogonal, generator, normalised=normalised)
    generator = torch.Generator().manual_seed(0)
    x, above = torch.randn(128, 30, generator=generator), torch.randn(2, 128, 1, generator=generator)
    expected = net(x)
    (gradient,) = torch.autograd.grad(expected, [net.flat], above)
    passes = Passes(net, torch.bfloat16, Room(CPU))
    with torch.no_grad():
        assert relative(passes.forward(x), expected) < 0.03
        passes.backward(above)
    similarity = torch.nn.functional.cosine_similarity(passes.gradient, gradient, dim=0)
    assert similarity > 0.999
    assert passes.gradient.dtype == torch.float32
    with torch.no_grad():
        net.flat.neg_()
    before = passes.forward(x)
    passes.refresh()
    assert relative(passes.forward(x), before) > 0.1  # weights are taken over when told


UPDATES: dict[str, Callable[[SACAgent], Update]] = {
    "plain": AutogradUpdate,
    "by hand": lambda learner: UpdateByHand(learner, torch.float32),
}


def agent(
    update: str, observation: int, action: int, width: int, depth: int, normalised: bool, seed: int
) -> SACAgent:
    config = SAC(
        width=width,
        depth=depth,
        layer_norm=normalised,
        batch_size=32,
        learning_rate=1e-3,
        temperature_learning_rate=1e-2,
    )
    made = SACAgent(config, observation, action, 100, Randomness(seed), CPU)
    made._update = UPDATES[update](made)
    rng = np.random.default_rng(seed)
    for _ in range(50):
        rows = [rng.normal(size=(1, n)).astype(np.float32) for n in (observation, action, observation)]
        reward = rng.normal(size=1).astype(np.float32)
        made.observe(lived(rows[0], np.tanh(rows[1]), rows[2], rng.random(1) < 0.2), torch.from_numpy(reward))
    return made


@settings(max_examples=15, deadline=None)
@given(
    st.integers(1, 12),
    st.integers(1, 5),
    st.integers(8, 32),
    st.integers(1, 3),
    st.booleans(),
    st.integers(0, 10**6),
)
def test_an_update_by_hand_equals_one_under_autograd(
    observation: int, action: int, width: int, depth: int, normalised: bool, seed: int
) -> None:
    sizes = (observation, action, width, depth)
    plain, by_hand = (agent(kind, *sizes, normalised, seed) for kind in ("plain", "by hand"))
    said = [learner.update().read() for learner in (plain, by_hand)]
    assert said[1] == pytest.approx(said[0], rel=1e-4, abs=1e-5)
    for ours, theirs in (
        (by_hand.critic.twins.flat, plain.critic.twins.flat),
        (by_hand.actor.trunk.flat, plain.actor.trunk.flat),
        (by_hand.log_temperature, plain.log_temperature),
    ):
        assert ours.grad is not None
        assert theirs.grad is not None
        assert relative(ours.grad, theirs.grad) < 1e-5
    # Adam's first steps are of one size however small the gradient, so that rounding may turn a few about.
    for _ in range(5):
        plain.update()
    by_hand.load(plain.state())
    by_hand._sampling.set_state(plain._sampling.get_state())
    for learner in (plain, by_hand):
        learner.update()
    for network in ("critic.twins", "target_critic.twins", "actor.trunk"):
        ours, theirs = (attrgetter(network)(one).flat.detach() for one in (by_hand, plain))
        assert relative(ours, theirs) < 1e-5


def test_flat_adam_is_adam() -> None:
    ours, theirs = (torch.randn(50, generator=torch.Generator().manual_seed(0)) for _ in range(2))
    optimizers = FlatAdam((ours, 1e-2)), torch.optim.Adam([theirs], lr=1e-2)
    for step in range(5):
        gradient = torch.randn(50, generator=torch.Generator().manual_seed(step))
        ours.grad, theirs.grad = gradient, gradient.clone()
        for optimizer in optimizers:
            optimizer.step()
    torch.testing.assert_close(ours, theirs, rtol=1e-6, atol=1e-7)
    with pytest.raises(RuntimeError, match=r"shape \(3,\) has no gradient"):
        FlatAdam((torch.zeros(3), 1.0)).step()


def test_flat_adam_goes_on_from_its_state() -> None:
    def lived(steps: int) -> tuple[torch.Tensor, FlatAdam]:
        tensor = torch.zeros(4)
        optimizer = FlatAdam((tensor, 0.1))
        for step in range(steps):
            tensor.grad = torch.full((4,), float(step + 1))
            optimizer.step()
        return tensor, optimizer

    whole, _ = lived(3)
    tensor, half = lived(2)
    resumed = FlatAdam((tensor, 0.1))
    resumed.load(half.state())
    tensor.grad = torch.full((4,), 3.0)
    resumed.step()
    assert torch.equal(tensor, whole)


# The reward model --------------------------------------------------------------------------------


def reward_model(**changes: float) -> RewardModel:
    return RewardModel(LearnedReward(width=16, **changes), 3, 2, Randomness(0), CPU)


@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(10, 60), min_size=2, max_size=4), st.integers(1, 10), st.integers(1, 4))
def test_candidates_scored_by_running_sums_equal_each_scored_by_itself(
    lengths: list[int], steps: int, members: int
) -> None:
    pairs = PairSampler(pool_of(*lengths), steps, np.random.default_rng(0)).draw(60)
    model = reward_model(members=members)
    with torch.no_grad():
        model.members.flat.mul_(3)
    first, second = (torch.from_numpy(np.stack([pair[side].inputs for pair in pairs])) for side in (0, 1))
    sums = [
        torch.tanh(model.members(s.flatten(0, 1))[..., 0]).view(members, 60, -1).sum(-1)
        for s in (first, second)
    ]
    expected = torch.sigmoid(preference_logit(*sums)).detach()
    torch.testing.assert_close(pair_probabilities(model, pairs), expected, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("dtype", [torch.float32, torch.bfloat16])
def test_a_new_row_has_the_reward_that_relabelling_would_give_it(dtype: torch.dtype) -> None:
    """Bit by bit but for the order in which sums are taken: both in the same precision."""
    model = RewardModel(LearnedReward(width=256), 3, 2, Randomness(0), CPU, dtype)
    rows = torch.randn(512, 5, generator=torch.Generator().manual_seed(0))
    alone = torch.cat([model(row[None]) for row in rows[:64]])
    together = model(rows)[:64]
    deviation = float(together.std())
    assert float((alone - together).abs().max()) < (1e-4 if dtype == torch.float32 else 0.02) * deviation
    assert float((alone - together).abs().median()) < 1e-3 * deviation


@settings(max_examples=20, deadline=None)
@given(
    st.integers(1, 5), st.integers(1, 8), st.integers(1, 4), st.sampled_from([0.0, 0.1]), st.integers(1, 5)
)
def test_the_gradient_of_a_fit_is_that_of_the_loss(
    quarter: int, steps: int, members: int, smoothing: float, parts: int
) -> None:
    model, count = reward_model(label_smoothing=smoothing, members=members), 4 * quarter
    generator = torch.Generator().manual_seed(0)
    first, second = (torch.randn(count, steps, 5, generator=generator) for _ in range(2))
    preferences = Preferences(first, second, torch.tensor([0.0, 1.0, 0.5, 0.25] * quarter))
    rows = torch.stack([torch.randperm(count, generator=generator) for _ in range(members)])
    sums = [
        torch.tanh(model.members(s[rows].flatten(1, 2))[..., 0]).view(members, count, steps).sum(-1)
        for s in (first, second)
    ]
    loss = preference_loss(preference_logit(*sums), preferences.label[rows], smoothing).mean(1).sum()
    (expected,) = torch.autograd.grad(loss, [model.members.flat])
    model._rows = 2 * steps * count // parts
    right = model._learn(preferences, rows)
    assert relative(model._passes.gradient, expected) < 1e-5
    assert len(right) == 3 * quarter * members
