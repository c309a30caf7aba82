"""Every agent and reward model must solve a task so small that failing it means being wrong."""

from __future__ import annotations

import numpy as np
import torch

from labels_db.run_config import SAC, LearnedReward
from tests.trainer.given import lived
from trainer.agents.sac import SACAgent
from trainer.randomness import Randomness
from trainer.reward_model import Preferences, RewardModel

CPU = torch.device("cpu")


def test_sac_learns_to_do_what_it_sees() -> None:
    """Reward −(a − s)², each step an episode of its own: the best action is the observation."""
    rng = np.random.default_rng(0)
    config = SAC(width=32, batch_size=64, learning_rate=3e-3)
    agent = SACAgent(config, 1, 1, 1000, Randomness(3), CPU)
    seen = rng.uniform(-0.8, 0.8, (500, 1)).astype(np.float32)
    done = rng.uniform(-1, 1, (500, 1)).astype(np.float32)
    agent.observe(lived(seen, done, seen, np.ones(500, bool)), torch.from_numpy(-((done - seen) ** 2)[:, 0]))
    for _ in range(600):
        agent.update()
    asked = np.linspace(-0.7, 0.7, 15, dtype=np.float32)[:, None]
    assert np.abs(agent.act(asked, explore=False) - asked).mean() < 0.1


def test_sac_prefers_the_reward_it_is_handed_over_the_stored_one() -> None:
    rng = np.random.default_rng(0)
    agent = SACAgent(SAC(width=32, batch_size=64, learning_rate=3e-3), 1, 1, 500, Randomness(3), CPU)
    zeros = np.zeros((500, 1), np.float32)
    done = rng.uniform(-1, 1, (500, 1)).astype(np.float32)
    agent.observe(lived(zeros, done, zeros, np.ones(500, bool)), torch.from_numpy(-10 * done[:, 0]))
    for _ in range(500):
        agent.update(lambda batch: 10 * batch.action[:, 0])
    assert agent.act(zeros[:1], explore=False)[0, 0] > 0.7


def test_reward_model_recovers_the_order_of_a_hidden_reward() -> None:
    generator = torch.Generator().manual_seed(0)
    segments = torch.randn(2, 400, 5, 4, generator=generator)
    worth = torch.tanh(segments[..., 0] - 0.5 * segments[..., 3]).sum(-1)
    label = (worth[1] > worth[0]).float()
    model = RewardModel(LearnedReward(width=64), 3, 1, Randomness(0), CPU)
    train, test = torch.arange(300), torch.arange(300, 400)
    preferences = Preferences(segments[0], segments[1], label)
    before = model.accuracy(preferences[test])
    report = model.fit(preferences[train], preferences[test])
    after = model.accuracy(preferences[test])
    assert report.fresh_accuracy == before  # measured before training on anything
    assert after is not None
    assert after > 0.85
    assert report.training_accuracy is not None
    assert report.training_accuracy > 0.9


def test_equal_answers_pull_two_segments_together() -> None:
    generator = torch.Generator().manual_seed(1)
    segments = torch.randn(2, 64, 5, 4, generator=generator)
    model = RewardModel(LearnedReward(width=32, max_epochs=200), 3, 1, Randomness(0), CPU)
    with torch.no_grad():
        for parameter in model.members.parameters():
            parameter.mul_(3)  # members with opinions
    preferences = Preferences(segments[0], segments[1], torch.full((64,), 0.5))
    before = (model.probabilities(*segments) - 0.5).abs().mean()
    report = model.fit(preferences)
    assert (model.probabilities(*segments) - 0.5).abs().mean() < 0.5 * before
    assert report.training_accuracy is None
    assert report.epochs == 200
