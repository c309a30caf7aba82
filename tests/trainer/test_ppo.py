"""PPO by stable-baselines3 in our own loop: what it is handed, what it remembers, what it learns."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest
import torch

from labels_db.models import RunState
from labels_db.run_config import RunConfig
from tests.trainer.conftest import RUN, Lab, small_config
from tests.trainer.given import lived
from tests.trainer.test_checkpoint_format import alter, drop, error_of_resumed
from tests.trainer.whole_runs import live_until
from trainer.agents.interface import BatchReward
from trainer.agents.normaliser import Normaliser
from trainer.agents.ppo import PPOAgent
from trainer.agents.registry import make_agent, policy_layers
from trainer.collector import Transitions
from trainer.policy_layers import roll_out
from trainer.randomness import Randomness
from trainer.replay import replay
from trainer.replay_buffer import Batch
from trainer.state_tree import pack, unpack

pytestmark = pytest.mark.contracts

N, T = 3, 8
D, A = 5, 1  # of the cart pole


def config(**changes: Any) -> RunConfig:
    settings = {
        "agent__kind": "ppo",
        "agent__width": 16,
        "agent__depth": 2,
        "agent__rollout_steps": T,
        "agent__batch_size": 8,
        "agent__epochs": 2,
        "exploration__kind": "random",
        "exploration__seed_steps": 0,
        "environments": N,
    }
    return small_config(**{**settings, **changes})


def agent(**changes: Any) -> PPOAgent:
    made = make_agent(config(**changes), Randomness(5), torch.device("cpu"))
    assert isinstance(made, PPOAgent)
    return made


def live(learner: PPOAgent, steps: int, seed: int = 0) -> list[Transitions]:
    """Steps among noise; nothing ends."""
    rng = np.random.default_rng(seed)
    seen = rng.normal(size=(steps + 1, N, D)).astype(np.float32)
    rewards = rng.normal(size=(steps, N)).astype(np.float32)
    done = []
    for step in range(steps):
        learner.learn(None, N)
        actions = learner.act(seen[step], explore=True)
        done.append(lived(seen[step], actions, seen[step + 1], np.zeros(N, bool)))
        learner.observe(done[-1], torch.from_numpy(rewards[step]))
    return done


def test_it_learns_from_complete_rollouts_only() -> None:
    learner = agent()
    before = {name: weights.clone() for name, weights in learner.state()["policy"].items()}
    live(learner, T - 1)
    assert learner.learn(None, N) is None
    live(learner, 1)
    losses = learner.learn(None, N)
    assert losses is not None
    assert {"value_loss", "policy_gradient_loss", "approx_kl", "batch_reward"} <= set(losses.read())
    assert any(not torch.equal(weights, before[n]) for n, weights in learner.state()["policy"].items())
    assert learner.learn(None, N) is None


def test_actions_lie_in_their_range_though_the_policy_has_none() -> None:
    learner = agent()
    actions = np.concatenate([t.actions for t in live(learner, T)])
    assert np.abs(actions).max() <= 1
    assert np.abs(learner.rollout.columns["actions"]).max() > 1


def test_advantages_are_those_of_the_rewards_at_the_rollouts_end() -> None:
    """Generalised advantages by hand, from rewards written anew after they were lived, one episode cut off."""
    learner = agent(agent__gae_lambda=0.8, agent__discount=0.9)
    live(learner, 4)
    seen = np.ones((N, D), np.float32)
    actions = learner.act(seen, explore=True)
    ended = np.array([True, True, False])
    terminated = np.array([True, False, False])
    step = lived(seen, actions, 2 * seen, terminated)
    learner.observe(Transitions(**{**vars(step), "ended": ended}), torch.ones(N))
    ahead = learner._values(2 * seen)
    live(learner, T - 5, seed=1)
    learner.relabel(lambda inputs: inputs[:, 0] + 3 * inputs[:, -1], lambda: None)
    batch = learner.buffer.latest(T * N)
    torch.testing.assert_close(batch.reward, batch.observation[:, 0] + 3 * batch.action[:, 0])
    rewards = batch.reward.view(T, N).numpy().copy()
    rewards[4, 1] += 0.9 * ahead[1]
    last, values = learner._values(learner._following), learner.rollout.columns["values"].copy()
    following = np.vstack([values[1:], last])
    going_on = np.ones((T, N), np.float32)
    going_on[4] = ~ended
    expected, advantage = np.zeros((T, N)), np.zeros(N)
    for t in reversed(range(T)):
        error = rewards[t] + 0.9 * going_on[t] * following[t] - values[t]
        advantage = error + 0.9 * 0.8 * going_on[t] * advantage
        expected[t] = advantage
    learner.learn(None, N)
    found = learner._library.rollout_buffer.advantages
    # The library lays its buffer out as one column, environment after environment.
    np.testing.assert_allclose(found.reshape(N, T).T, expected, rtol=1e-4, atol=1e-5)


def test_another_reward_may_take_the_place_of_the_stored_one() -> None:
    learner = agent()
    live(learner, T)
    losses = learner.learn(lambda batch: torch.full((len(batch.rows),), 7.0), N)
    assert losses is not None
    assert losses.read()["batch_reward"] == 7.0


@pytest.mark.parametrize("noise", [True, False])
@pytest.mark.parametrize("steps", [3, T + 3])
def test_it_goes_on_from_its_state_in_the_middle_of_a_rollout(noise: bool, steps: int) -> None:
    settings = {"agent__state_dependent_noise": noise}
    one, other = agent(**settings), agent(**settings)
    live(one, steps)
    values, arrays = pack(one.state())
    other.buffer.table.copy_(one.buffer.table)
    other.buffer.added = one.buffer.added
    other.load(unpack(values, arrays))
    ends = []
    for learner in (one, other):
        live(learner, 2 * T, seed=1)
        ends.append((learner.act(np.ones((N, D), np.float32), explore=True), learner.state()["policy"]))
    np.testing.assert_array_equal(ends[0][0], ends[1][0])
    assert all(torch.equal(weights, ends[1][1][name]) for name, weights in ends[0][1].items())


def test_what_others_draw_is_not_shifted_by_it() -> None:
    torch.manual_seed(1)
    np.random.seed(1)
    learner = agent()
    live(learner, T)
    learner.learn(None, N)
    drawn = torch.rand(3), np.random.rand(3)
    torch.manual_seed(1)
    np.random.seed(1)
    assert torch.equal(drawn[0], torch.rand(3))
    np.testing.assert_array_equal(drawn[1], np.random.rand(3))


def test_beginning_anew_keeps_the_policy_and_forgets_the_values() -> None:
    learner = agent()
    for _ in range(2):
        live(learner, T)
        learner.learn(None, N)
    live(learner, 3)  # in the middle of the next rollout
    seen = np.ones((N, D), np.float32)
    actions, values = learner.act(seen, explore=False), learner._values(seen)
    learner.begin_anew(100, None)
    assert learner.rollout.filled == 0  # its values were the old network's
    np.testing.assert_array_equal(learner.act(seen, explore=False), actions)
    assert np.abs(learner._values(seen) - values).min() > 1e-4
    assert learner.state()["optimizer"] == {}


def test_a_complete_rollout_is_learned_from_before_beginning_anew() -> None:
    learner, seen = agent(), np.ones((N, D), np.float32)
    live(learner, T)
    before, rewarded = learner.act(seen, explore=False), []

    def other_reward(batch: Batch) -> torch.Tensor:
        rewarded.append(len(batch.rows))
        return batch.reward + 1

    learner.begin_anew(100, other_reward)
    assert rewarded == [T * N]
    assert np.abs(learner.act(seen, explore=False) - before).max() > 0


def other_reward(batch: Batch) -> torch.Tensor:
    return batch.reward + 1


@pytest.mark.parametrize("reward", [None, other_reward])
def test_epochs_are_those_of_exploration_until_it_begins_anew(reward: BatchReward | None) -> None:
    """Whatever reward it is handed, which it cannot tell from others."""
    settings = {"exploration__kind": "state-entropy", "agent__exploring_epochs": 5}
    learner, resumed = agent(**settings), agent(**settings)
    live(learner, T)
    learner.learn(reward, N)
    assert (learner.state()["updates"], learner.epochs) == (5, 5)
    learner.begin_anew(100, reward)
    live(learner, T)
    learner.learn(reward, N)
    assert (learner.state()["updates"], learner.epochs) == (2, 2)
    resumed.load(unpack(*pack(learner.state())))
    assert resumed.epochs == 2


def test_a_state_taken_while_exploring_goes_on_with_its_epochs_or_not_at_all() -> None:
    settings = {"exploration__kind": "state-entropy", "agent__epochs": 2, "agent__exploring_epochs": 5}
    learner, resumed = agent(**settings), agent(**settings)
    learner.epochs = 4  # whatever they are, they are the state's
    state = learner.state()
    resumed.load(state)
    assert resumed.epochs == 4
    del state["epochs"]
    with pytest.raises(KeyError, match="epochs"):
        resumed.load(state)


def test_a_checkpoint_without_epochs_is_refused_by_name(lab: Lab) -> None:
    settings = {"exploration__kind": "state-entropy", "exploration__explore_steps": 200}
    lab.request(config(**settings))
    assert live_until(lab, 100) is RunState.STOPPED
    alter(lab, partial(drop, "agent/epochs"))
    assert "lacks the part agent/epochs: made by another Pebble" in error_of_resumed(lab)


def test_without_exploration_there_is_one_number_of_epochs() -> None:
    learner = agent(agent__exploring_epochs=5)
    live(learner, T)
    learner.learn(other_reward, N)
    assert learner.state()["updates"] == 2


@pytest.mark.parametrize("steps", [T - 3, T])
def test_it_begins_a_rollout_where_its_transitions_are_gone(steps: int) -> None:
    """As a finished run that is extended: it has kept its networks and dropped its rows."""
    learner, extended = agent(), agent()
    live(learner, steps)
    extended.load(learner.state())
    assert extended.rollout.filled == 0
    live(extended, T)
    losses = extended.learn(None, N)
    assert losses is not None
    rewards = extended.buffer.latest(T * N).reward
    assert losses.read()["batch_reward"] == pytest.approx(float(rewards.mean()))


def test_a_stopped_run_whose_clip_range_shrinks_repeats_exactly(lab: Lab) -> None:
    settings = {"agent__clip_schedule": "linear", "reward__kind": "true", "feedback__kind": "none"}
    lab.request(config(**settings, total_steps=600))
    assert live_until(lab, 300) is RunState.STOPPED
    assert replay(lab.database, lab.store, RUN, lambda _steps: None).same


@pytest.mark.parametrize("normalised", [True, False])
def test_its_policy_as_layers_says_the_same(normalised: bool) -> None:
    settings = {"agent__normalise_observations": normalised}
    learner = agent(**settings)
    for _ in range(2):
        live(learner, T)
        learner.learn(None, N)
    seen = 15 * np.random.default_rng(0).normal(size=(20, D)).astype(np.float32)
    layers = policy_layers(config(**settings), learner.state())
    np.testing.assert_allclose(roll_out(layers, seen), learner.act(seen, explore=False), atol=1e-6)


def test_the_normaliser_knows_mean_and_deviation_of_all_it_has_seen() -> None:
    seen = np.random.default_rng(0).normal(3, 2, size=(50, 4, D)).astype(np.float32)
    normaliser = Normaliser(D, learns=True)
    for rows in seen:
        normaliser.update(rows)
    flat = seen.reshape(-1, D)
    expected = (flat - flat.mean(0)) / flat.std(0)
    np.testing.assert_allclose(normaliser(flat), expected, atol=1e-4)
    assert np.abs(normaliser(1e6 * flat)).max() == 10


def test_ppo_learns_to_do_what_it_sees() -> None:
    """Reward −(a − s)², each step an episode of its own: the best action is the observation."""
    learner = agent(
        agent__learning_rate=3e-3,
        agent__rollout_steps=64,
        agent__batch_size=64,
        agent__epochs=10,
        agent__normalise_observations=False,
    )
    rng = np.random.default_rng(0)
    for _ in range(64 * 25):
        seen = rng.uniform(-0.8, 0.8, (N, D)).astype(np.float32)
        actions = learner.act(seen, explore=True)
        rewards = torch.from_numpy(-((actions - seen[:, :1]) ** 2)[:, 0])
        learner.observe(lived(seen, actions, seen, np.ones(N, bool)), rewards)
        learner.learn(None, N)
    asked = rng.uniform(-0.7, 0.7, (50, D)).astype(np.float32)
    assert np.abs(learner.act(asked, explore=False) - asked[:, :1]).mean() < 0.15


def test_random_steps_are_refused() -> None:
    with pytest.raises(ValueError, match=r"set exploration\.seed_steps to 0, not 130"):
        config(exploration__seed_steps=130)
