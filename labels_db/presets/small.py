"""Small tasks, which a laptop learns in minutes."""

from __future__ import annotations

from collections.abc import Iterator

from labels_db.presets.preset import Preset
from labels_db.run_config import (
    SAC,
    DMControl,
    Evaluation,
    LearnedReward,
    Oracle,
    RunConfig,
    Sessions,
    StateEntropy,
)


def small_tasks() -> Iterator[Preset]:
    yield _small("cartpole-swingup", action_repeat=4, total_steps=30_000)
    yield _small("ball_in_cup-catch", action_repeat=4, total_steps=30_000)
    yield _small("reacher-easy", action_repeat=4, total_steps=30_000)


def _small(task: str, *, action_repeat: int, total_steps: int) -> Preset:
    laptop = RunConfig(
        environment=DMControl(task=task, action_repeat=action_repeat),
        agent=SAC(width=128, batch_size=128, learning_rate=1e-3, temperature_learning_rate=1e-3),
        reward=LearnedReward(width=128, batch_size=32),
        exploration=StateEntropy(seed_steps=1000, explore_steps=4000),
        feedback=Sessions(
            teacher=Oracle(), budget=200, queries_per_session=20, steps_between=2000, pool_episodes=20
        ),
        evaluation=Evaluation(every=2500, episodes=5),
        total_steps=total_steps,
        precision="auto",
    )
    return Preset(task, {"laptop": laptop})
