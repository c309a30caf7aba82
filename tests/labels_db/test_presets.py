"""Ready configurations, the environments they name, and what they will need on disk."""

from __future__ import annotations

import pytest

from labels_db.catalogue import catalogue, entry
from labels_db.estimate import estimate_bytes
from labels_db.methods import method_named
from labels_db.overrides import with_settings
from labels_db.presets import preset_named, presets
from labels_db.run_config import PPO, SAC, LearnedReward, Oracle, RunConfig, Sessions, StateEntropy

PROFILES = [
    pytest.param(config, id=f"{name}-{profile}")
    for name, preset in presets().items()
    for profile, config in preset.profiles.items()
]
MB = 1_000_000


@pytest.mark.parametrize("method", ["ppo", "preference-ppo", "preference-ppo-pretrained"])
def test_ppo_s_noise_depends_on_the_state_but_on_a_laptop(method: str) -> None:
    for preset in presets().values():
        for profile in preset.profiles:
            agent = method_named(method).config(preset, profile).agent
            assert isinstance(agent, PPO)
            assert agent.state_dependent_noise == (profile != "laptop"), (preset.name, profile)


def test_each_preset_has_a_laptop_profile_first() -> None:
    for name, preset in presets().items():
        assert preset.name == name
        assert next(iter(preset.profiles)) == "laptop"
        assert preset.config() == preset.config("laptop")
        assert preset.title
        assert preset.goal


@pytest.mark.parametrize("config", PROFILES)
def test_each_profile_is_a_valid_configuration(config: RunConfig) -> None:
    assert RunConfig.model_validate_json(config.model_dump_json()) == config


@pytest.mark.parametrize(
    ("name", "answers"),
    [
        ("cartpole-windmill-clockwise", 50),
        ("cartpole-windmill-counter-clockwise", 50),
        ("quadruped-wave-left-front", 200),
        ("quadruped-wave-right-front", 200),
        ("hopper-backflip", 50),
        ("walker-walk-both-legs", 200),
    ],
)
def test_behaviours_ask_a_person_as_often_as_in_the_paper(name: str, answers: int) -> None:
    config = preset_named(name).config()
    assert config.asks_people
    assert config.budget == answers


@pytest.mark.parametrize(
    ("name", "rate", "answers", "steps"),
    [
        ("cartpole-windmill-clockwise", 1e-4, 50, 500_000),
        ("cartpole-windmill-counter-clockwise", 1e-4, 50, 500_000),
        ("quadruped-wave-left-front", 1e-4, 200, 1_000_000),
        ("quadruped-wave-right-front", 1e-4, 200, 1_000_000),
        ("hopper-backflip", 1e-4, 50, 1_000_000),
        ("walker-walk-both-legs", 5e-4, 200, 500_000),
    ],
)
def test_behaviours_have_the_papers_networks_and_answers(
    name: str, rate: float, answers: int, steps: int
) -> None:
    config = preset_named(name).config("paper")
    agent, exploration = config.agent, config.exploration
    assert isinstance(agent, SAC)
    assert isinstance(exploration, StateEntropy)
    assert (agent.width, agent.batch_size, agent.learning_rate) == (1024, 1024, rate)
    assert (config.budget, config.total_steps) == (answers, steps)
    assert config.segment_steps * config.step_seconds == pytest.approx(1)
    assert (exploration.transform, config.environment.action_repeat) == ("log", 1)
    assert config.precision == "float32"


@pytest.mark.parametrize(
    ("name", "rate", "width", "batch", "asked", "every", "budget", "segment", "steps"),
    [
        ("walker-walk", 5e-4, 1024, 1024, 140, 20_000, 1400, 50, 500_000),
        ("cheetah-run", 1e-3, 1024, 1024, 140, 20_000, 1400, 50, 1_000_000),
        ("quadruped-walk", 1e-4, 1024, 1024, 70, 20_000, 1400, 50, 1_000_000),
        ("drawer-close", 3e-4, 256, 512, 64, 2400, 10_000, 10, 1_000_000),
        ("window-open", 3e-4, 256, 512, 64, 2400, 10_000, 10, 1_000_000),
        ("door-open", 3e-4, 256, 512, 64, 2400, 10_000, 10, 1_000_000),
        ("button-press", 3e-4, 256, 512, 64, 2400, 10_000, 10, 1_000_000),
        ("sweep-into", 3e-4, 256, 512, 128, 4800, 50_000, 10, 1_000_000),
        ("drawer-open", 3e-4, 256, 512, 128, 4800, 50_000, 10, 1_000_000),
    ],
)
def test_profile_paper_is_the_papers_tables(
    name: str,
    rate: float,
    width: int,
    batch: int,
    asked: int,
    every: int,
    budget: int,
    segment: int,
    steps: int,
) -> None:
    config = preset_named(name).config("paper")
    agent, feedback = config.agent, config.feedback
    assert isinstance(agent, SAC)
    assert isinstance(feedback, Sessions)
    assert (agent.learning_rate, agent.width, agent.batch_size) == (rate, width, batch)
    assert agent.temperature_learning_rate == 1e-4
    assert (feedback.queries_per_session, feedback.steps_between) == (asked, every)
    assert (feedback.budget, config.segment_steps, config.total_steps) == (budget, segment, steps)
    assert (feedback.scheme.kind, config.exploration.ends_at) == ("entropy", 10_000)
    assert config.environment.action_repeat == 1


LOCOMOTION = ("walker-walk", "cheetah-run", "quadruped-walk")
MANIPULATION = ("drawer-close", "window-open", "door-open", "button-press", "sweep-into", "drawer-open")


@pytest.mark.parametrize(
    ("names", "profile", "epochs", "transform", "tie", "segment"),
    [
        (LOCOMOTION, "paper", 50, "log", "equal", 50),
        (LOCOMOTION, "public", 50, "distance", "first", 50),
        (LOCOMOTION, "few-labels", 50, "distance", "first", 50),
        (MANIPULATION, "paper", 10, "log", "equal", 10),
        (MANIPULATION, "public", 10, "distance", "first", 50),
        (("window-open", "door-open", "button-press"), "few-labels", 10, "distance", "first", 50),
    ],
)
def test_published_profiles_have_the_published_numbers(
    names: tuple[str, ...], profile: str, epochs: int, transform: str, tie: str, segment: int
) -> None:
    for name in names:
        config = preset_named(name).config(profile)
        agent, reward = config.agent, config.reward
        exploration, feedback = config.exploration, config.feedback
        assert isinstance(agent, SAC)
        assert isinstance(reward, LearnedReward)
        assert isinstance(exploration, StateEntropy)
        assert isinstance(feedback, Sessions)
        assert isinstance(feedback.teacher, Oracle)
        assert (agent.discount, agent.target_rate, agent.target_every) == (0.99, 0.005, 2)
        assert (agent.initial_temperature, agent.temperature_learning_rate) == (0.1, 1e-4)
        assert (agent.updates_per_step, agent.layer_norm, config.precision) == (1, False, "float32")
        assert (reward.members, reward.depth, reward.width, reward.batch_size) == (3, 3, 256, 128)
        assert (reward.learning_rate, reward.max_epochs, reward.stop_accuracy) == (3e-4, epochs, 0.97)
        assert (exploration.neighbours, exploration.transform) == (5, transform)
        assert (exploration.seed_steps, exploration.explore_steps) == (1000, 9000)
        assert exploration.reset_updates == 100
        assert (feedback.teacher.tie, config.segment_steps) == (tie, segment)
        assert (feedback.candidates_per_query, feedback.pool_episodes) == (10, 100)
        assert (config.evaluation.every, config.evaluation.episodes) == (10_000, 10)


@pytest.mark.parametrize(
    ("profile", "clip", "schedule"), [("paper", 0.2, "constant"), ("public", 0.4, "linear")]
)
def test_ppo_has_the_published_numbers(profile: str, clip: float, schedule: str) -> None:
    for name in (*LOCOMOTION, *MANIPULATION):
        config = method_named("preference-ppo-pretrained").config(preset_named(name), profile)
        agent = config.agent
        assert isinstance(agent, PPO)
        assert (agent.gae_lambda, agent.discount, agent.entropy_bonus) == (0.92, 0.99, 0)
        assert (agent.epochs, agent.exploring_epochs, agent.depth) == (20, 50, 3)
        assert (agent.noise_steps, agent.normalise_observations) == (4, True)
        assert (agent.clip_range, agent.clip_schedule) == (clip, schedule)
        assert config.exploration.ends_at == 32_000


@pytest.mark.parametrize(
    ("name", "budget", "asked", "every", "steps"),
    [
        ("walker-walk", 100, 10, 20_000, 500_000),
        ("cheetah-run", 100, 10, 20_000, 1_000_000),
        ("quadruped-walk", 1000, 100, 30_000, 1_000_000),
        ("door-open", 3000, 30, 5000, 1_000_000),
        ("window-open", 400, 10, 5000, 500_000),
        ("button-press", 2000, 25, 5000, 1_000_000),
    ],
)
def test_profile_few_labels_is_what_later_papers_compare_with(
    name: str, budget: int, asked: int, every: int, steps: int
) -> None:
    config = preset_named(name).config("few-labels")
    feedback = config.feedback
    assert isinstance(feedback, Sessions)
    assert (feedback.budget, feedback.queries_per_session, feedback.steps_between) == (budget, asked, every)
    assert config.total_steps == steps


@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        ("walker-wolk", "preset 'walker-wolk': unknown; one of walker-walk"),
        ("gym:Hoper-v5", "one of gym:Hopper-v5, or add it with `pebble environments --add gym:Hoper-v5`"),
        ("x", "one of cartpole-windmill"),
    ],
)
def test_an_unknown_preset_is_named_with_the_closest(name: str, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        preset_named(name)


@pytest.mark.parametrize("name", sorted(catalogue()))
def test_every_environment_has_a_preset_of_its_name(name: str) -> None:
    preset = preset_named(name)
    assert (preset.name, preset.environment) == (name, name)
    assert preset.title == entry(name).title
    for profile in preset.profiles:
        assert preset.config(profile).environment.name == name


@pytest.mark.parametrize(
    ("name", "segment", "seconds", "pool"),
    [
        ("gym:Hopper-v5", 13, 0.104, 100),
        ("gym:Walker2d-v5", 13, 0.104, 100),
        ("gym:Humanoid-v5", 14, 0.21, 100),
        ("gym:InvertedPendulum-v5", 3, 0.12, 100),
        ("gym:InvertedDoublePendulum-v5", 4, 0.2, 100),
        ("gym:Ant-v5", 20, 1.0, 20),  # whose random episodes last longer than a second
        ("gym:HalfCheetah-v5", 20, 1.0, 20),
        ("dmc:lqr-lqr_2_1", 8, 0.96, 20),
    ],
)
def test_segments_are_shorter_than_random_episodes_that_end_early(
    name: str, segment: int, seconds: float, pool: int
) -> None:
    config = preset_named(name).config()
    assert config.segment_steps == segment
    assert config.segment_steps * config.step_seconds == pytest.approx(seconds)
    assert isinstance(config.feedback, Sessions)
    assert config.feedback.pool_episodes == pool


def test_any_manipulation_task_has_the_papers_settings() -> None:
    ours, paper = (preset_named(name).config("paper") for name in ("metaworld:push", "drawer-close"))
    assert ours.model_copy(update={"environment": paper.environment}) == paper


def test_an_unknown_profile_is_named_with_those_there_are() -> None:
    with pytest.raises(ValueError, match="profile 'huge': walker-walk has laptop, paper"):
        preset_named("walker-walk").config("huge")


# The catalogue -----------------------------------------------------------------------------------


def test_the_catalogue_knows_every_environment_it_lists() -> None:
    for name, known in catalogue().items():
        assert known.name == name
        assert name.partition(":")[0] in {"dmc", "behaviour", "metaworld", "gym"}
        assert min(known.observation_size, known.action_size, known.state_size, known.episode_steps) > 0
        assert 0 < known.control_step <= 0.25
        assert known.title
        assert known.goal


@pytest.mark.parametrize("name", ["dmc:walker-wolk", "walker-walk"])
def test_an_unknown_environment_is_named_with_the_closest(name: str) -> None:
    with pytest.raises(ValueError, match=f"environment '{name}': unknown; did you mean dmc:walker"):
        entry(name)


# The estimate ------------------------------------------------------------------------------------


@pytest.mark.parametrize("config", PROFILES)
def test_an_estimate_is_the_sum_of_plausible_parts(config: RunConfig) -> None:
    found = estimate_bytes(config)
    parts = (found.checkpoints, found.segments, found.clips, found.videos, found.database)
    assert found.total == sum(parts)
    assert all(part >= 0 for part in parts)
    assert MB < found.total < 20_000 * MB  # 50 000 queries of 50 steps, states and all, weigh 12 GB


def test_only_people_need_clips() -> None:
    human = preset_named("cartpole-windmill-clockwise").config()
    assert estimate_bytes(human).clips == 2 * 50 * 150_000
    scripted = with_settings(human, {"feedback.teacher.kind": "oracle"})
    assert estimate_bytes(scripted).clips == 0


def test_a_longer_run_needs_more_and_a_smaller_buffer_less() -> None:
    config = preset_named("walker-walk").config("paper")
    longer = with_settings(config, {"total_steps": "1000000"})
    smaller = with_settings(config, {"agent.replay_capacity": "10000"})
    assert estimate_bytes(smaller).total < estimate_bytes(config).total < estimate_bytes(longer).total
