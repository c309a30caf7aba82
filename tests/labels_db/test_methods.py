"""The methods that are compared: every one is a valid configuration of every preset, in every profile."""

from __future__ import annotations

import pytest

from labels_db.methods import method_named, methods
from labels_db.presets import preset_named, presets
from labels_db.run_config import PPO, SAC, Sessions, StateEntropy


@pytest.mark.parametrize("name", list(methods()))
def test_every_method_fits_every_preset(name: str) -> None:
    for preset in presets().values():
        for profile in preset.profiles:
            config = method_named(name).config(preset, profile)
            assert config.environment == preset.config(profile).environment


def test_the_methods_that_the_paper_compares_are_there() -> None:
    expected = {
        "pebble",
        "sac",
        "ppo",
        "preference-ppo",
        "preference-ppo-pretrained",
        "pebble-no-relabel",
        "pebble-no-pretraining",
        "pebble-no-relabel-no-pretraining",
        "pebble-segment-1",
        "pebble-k-center-entropy",
        "pebble-decreasing",
        "pebble-members-1",
    }
    assert expected <= methods().keys()


@pytest.mark.parametrize(
    ("name", "agent", "reward", "explores", "asks"),
    [
        ("pebble", SAC, "learned", True, True),
        ("sac", SAC, "true", False, False),
        ("ppo", PPO, "true", False, False),
        ("preference-ppo", PPO, "learned", False, True),
        ("preference-ppo-pretrained", PPO, "learned", True, True),
        ("pebble-no-pretraining", SAC, "learned", False, True),
    ],
)
def test_a_method_is_agent_reward_exploration_and_feedback(
    name: str, agent: type, reward: str, explores: bool, asks: bool
) -> None:
    config = method_named(name).config(preset_named("walker-walk"), "paper")
    assert isinstance(config.agent, agent)
    assert config.reward.kind == reward
    assert isinstance(config.exploration, StateEntropy) is explores
    assert isinstance(config.feedback, Sessions) is asks


def test_preference_ppo_has_the_papers_settings() -> None:
    config = method_named("preference-ppo").config(preset_named("walker-walk"), "paper")
    assert isinstance(config.agent, PPO)
    assert isinstance(config.feedback, Sessions)
    assert (config.agent.learning_rate, config.agent.gae_lambda, config.agent.clip_range) == (5e-5, 0.92, 0.2)
    assert (config.agent.width, config.agent.depth, config.agent.batch_size) == (1024, 3, 128)
    assert (config.environments, config.agent.rollout_steps, config.total_steps) == (32, 100, 4_000_000)
    assert (config.feedback.scheme.kind, config.feedback.queries_per_session) == ("disagreement", 70)
    assert (config.feedback.budget, config.feedback.steps_between) == (2100, 16_000)
    pretrained = method_named("preference-ppo-pretrained").config(preset_named("walker-walk"), "paper")
    assert pretrained.exploration.ends_at == 32_000


def test_ablations_change_one_thing() -> None:
    base = preset_named("walker-walk").config("paper")
    changes = {
        "pebble-no-relabel": {"reward"},
        "pebble-no-pretraining": {"exploration"},
        "pebble-uniform": {"feedback"},
        "pebble-segment-10": {"feedback"},
        "pebble-increasing": {"feedback"},
        "pebble-members-5": {"reward"},
    }
    for name, changed in changes.items():
        config = method_named(name).config(preset_named("walker-walk"), "paper")
        found = {part for part in type(base).model_fields if getattr(config, part) != getattr(base, part)}
        assert found == changed, name


def test_an_unknown_method_is_named_with_the_closest() -> None:
    with pytest.raises(
        ValueError, match="method 'pebble-no-relable': unknown; did you mean pebble-no-relabel"
    ):
        method_named("pebble-no-relable")


@pytest.mark.parametrize("task", ["walker-walk", "cheetah-run", "quadruped-walk", "door-open", "window-open"])
def test_with_few_labels_preference_ppo_is_given_no_more_than_pebble(task: str) -> None:
    preset = preset_named(task)
    given = []
    for name in ("pebble", "preference-ppo"):
        feedback = method_named(name).config(preset, "few-labels").feedback
        assert isinstance(feedback, Sessions)
        given.append((feedback.budget, feedback.queries_per_session, feedback.steps_between))
    assert given[0] == given[1]


@pytest.mark.parametrize(
    ("task", "profile", "rate", "width", "copies", "steps", "batch", "asked"),
    [
        ("walker-walk", "paper", 5e-5, 1024, 32, 100, 128, 70),
        ("cheetah-run", "paper", 5e-5, 1024, 16, 100, 512, 70),
        ("quadruped-walk", "paper", 1e-4, 1024, 16, 500, 128, 70),
        ("quadruped-walk", "public", 1e-4, 1024, 16, 500, 128, 70),
        ("door-open", "paper", 3e-4, 256, 32, 250, 128, 256),
        ("door-open", "public", 3e-4, 256, 32, 250, 256, 256),
    ],
)
def test_published_ppo_is_its_tables(
    task: str, profile: str, rate: float, width: int, copies: int, steps: int, batch: int, asked: int
) -> None:
    config = method_named("preference-ppo").config(preset_named(task), profile)
    agent, feedback = config.agent, config.feedback
    assert isinstance(agent, PPO)
    assert isinstance(feedback, Sessions)
    assert (agent.learning_rate, agent.width, agent.depth, agent.epochs) == (rate, width, 3, 20)
    assert (config.environments, agent.rollout_steps, agent.batch_size) == (copies, steps, batch)
    assert (feedback.queries_per_session, config.evaluation.every) == (asked, 10_000)
    assert agent.clip_range == (0.2 if profile == "paper" else 0.4)
