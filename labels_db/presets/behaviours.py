"""The paper's human experiments: behaviours that nobody has written a reward for (sections 5.4 and 5.5)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from labels_db.overrides import Settings
from labels_db.presets.locomotion import PAPER_PPO, QUADRUPED_PPO, WALKER_PPO, laptop
from labels_db.presets.preset import Preset
from labels_db.run_config import (
    SAC,
    Behaviour,
    Disagreement,
    Evaluation,
    Human,
    LearnedReward,
    RunConfig,
    Sessions,
    StateEntropy,
)

# Small runs with few answers differ from the paper's in more than size. A learned reward is small at first: at
# the paper's temperature rate of 1e-4 the entropy bonus outweighs it for 10 000 steps. A batch of 128 would make
# fits of 50 or 200 answers one or two gradient steps an epoch. And of a windmill's 80 episodes most are from
# policies long overcome: it asks about the latest 20, a quarter, as the paper's walker about 100 of 500.

STEPS = 100_000
"""Of a laptop's run, but for the windmills'."""


def behaviours() -> Iterator[Preset]:
    yield _windmill("cartpole-windmill-clockwise")
    yield _windmill("cartpole-windmill-counter-clockwise")
    yield _novel("quadruped-wave-left-front", QUADRUPED_PPO, budget=200, rate=1e-4, total_steps=1_000_000)
    yield _novel("quadruped-wave-right-front", QUADRUPED_PPO, budget=200, rate=1e-4, total_steps=1_000_000)
    yield _novel("hopper-backflip", WALKER_PPO, budget=50, rate=1e-4, total_steps=1_000_000)
    yield _novel("walker-walk-both-legs", WALKER_PPO, budget=200, rate=5e-4, total_steps=500_000)


def _windmill(behaviour: str) -> Preset:
    small = RunConfig(
        environment=Behaviour(behaviour=behaviour, action_repeat=4),
        agent=SAC(width=128, batch_size=128, learning_rate=1e-3, temperature_learning_rate=1e-3),
        reward=LearnedReward(width=128, batch_size=32),
        exploration=StateEntropy(seed_steps=1000, explore_steps=2000),
        # 2500 steps take a laptop about as long as a person takes for ten answers, 25 s.
        feedback=Sessions(
            teacher=Human(),
            budget=50,
            queries_per_session=10,
            steps_between=2500,
            pace="stream",
            patience_steps=5000,
            pool_episodes=20,
        ),
        evaluation=Evaluation(every=2500, episodes=1),
        total_steps=20_000,
        precision="auto",
    )
    as_published = published(behaviour, budget=50, rate=1e-4, total_steps=500_000)
    return Preset(behaviour, {"laptop": small, "paper": as_published}, _on_policy(WALKER_PPO))


def _novel(behaviour: str, ppo: Settings, *, budget: int, rate: float, total_steps: int) -> Preset:
    profiles = {
        "laptop": novel(behaviour, budget=budget),
        "paper": published(behaviour, budget=budget, rate=rate, total_steps=total_steps),
    }
    return Preset(behaviour, profiles, _on_policy(ppo))


def _on_policy(ppo: Settings) -> Mapping[str, Settings]:
    return {"paper": {**PAPER_PPO, **ppo}}


def novel(behaviour: str, *, budget: int = 200) -> RunConfig:
    """A person teaches what takes more than a cart pole, to the networks that locomotion has."""
    # The last answers come with half of the steps still to go, for the policy to catch up with them.
    asked = min(10, budget // 10)
    feedback = Sessions(
        teacher=Human(),
        scheme=Disagreement(),  # of the schemes tried the one by which a walker got going: benchmarks/README.md
        budget=budget,
        queries_per_session=asked,
        steps_between=STEPS // 2 * asked // budget,
        pace="stream",
        pool_episodes=20,
    )
    evaluation = Evaluation(every=10_000, episodes=1)
    # So few answers are learned in small batches and to the end of every fit: benchmarks/README.md.
    reward = LearnedReward(depth=1, batch_size=8, stop_accuracy=1)
    known = laptop(Behaviour(behaviour=behaviour, action_repeat=4), STEPS)
    return known.model_copy(update={"feedback": feedback, "evaluation": evaluation, "reward": reward})


def published(behaviour: str, *, budget: int, rate: float, total_steps: int) -> RunConfig:
    """The paper's networks and its answers. It gives neither rates nor steps for these: they are its quadruped's and
    walker's, and for robots that are in none of its tasks the quadruped's, the smallest of its rates.
    """
    return RunConfig(
        environment=Behaviour(behaviour=behaviour),
        agent=SAC(width=1024, depth=2, batch_size=1024, learning_rate=rate),
        exploration=StateEntropy(transform="log"),
        feedback=Sessions(teacher=Human(), budget=budget, queries_per_session=10, steps_between=20_000),
        evaluation=Evaluation(every=10_000, episodes=10),
        total_steps=total_steps,
    )
