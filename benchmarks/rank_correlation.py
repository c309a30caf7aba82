"""Whether rewards rounded to bfloat16 keep their order: `python -m benchmarks.rank_correlation`.

Spearman's correlation of r̂ in float32 and with products in bfloat16, within minibatches of a task's own states,
for a fresh reward model and for the same one after a fit; the least of all minibatches counts.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import torch
from scipy.stats import spearmanr

from labels_db.presets import preset_named
from labels_db.run_config import LearnedReward
from trainer.environments import make_environment
from trainer.randomness import Randomness
from trainer.reward_model import Preferences, RewardModel

TASKS = ("cartpole-swingup", "walker-walk", "quadruped-walk")
SEEDS = (1, 2, 3)
STEPS, LABELS, SEGMENT = 8000, 200, 50
MINIBATCHES, ROWS = 40, 256
RESULTS = Path(__file__).parent / "results"


def wandered(task: str) -> tuple[torch.Tensor, torch.Tensor, tuple[int, int]]:
    """Inputs [STEPS, D + A] and true rewards of smooth random actions, and both sizes."""
    environment, rng = make_environment(preset_named(task).config().environment), np.random.default_rng(0)
    observation, _ = environment.reset(seed=0)
    action = np.zeros(environment.action_space.shape or (1,), np.float32)
    sizes, inputs, rewards = (len(observation), len(action)), [], []
    for step in range(STEPS):
        action = np.clip(0.9 * action + 0.4 * rng.normal(size=action.shape), -1, 1).astype(np.float32)
        inputs.append(np.concatenate([observation, action]))
        observation, reward, terminated, truncated, _ = environment.step(action)
        rewards.append(float(reward))
        if terminated or truncated:
            observation, _ = environment.reset(seed=step)
    return torch.from_numpy(np.stack(inputs)), torch.tensor(rewards), sizes


def least_correlation(exact: torch.Tensor, rounded: torch.Tensor) -> float:
    """Of all minibatches of rewards [STEPS]."""
    rng = np.random.default_rng(0)
    drawn = (rng.integers(0, len(exact), ROWS) for _ in range(MINIBATCHES))
    return float(min(spearmanr(exact[rows], rounded[rows]).statistic for rows in drawn))


def preferences(inputs: torch.Tensor, rewards: torch.Tensor, seed: int) -> Preferences:
    """What a perfectly rational teacher would say of random pairs."""
    starts = np.random.default_rng(seed).integers(0, STEPS - SEGMENT, (2, LABELS))
    first, second = (torch.stack([inputs[at : at + SEGMENT] for at in side]) for side in starts)
    sums = [torch.stack([rewards[at : at + SEGMENT].sum() for at in side]) for side in starts]
    return Preferences(first, second, (sums[1] > sums[0]).float())


def measured(task: str) -> Iterator[dict[str, Any]]:
    inputs, rewards, sizes = wandered(task)
    for seed in SEEDS:
        exact, rounded = (
            RewardModel(
                LearnedReward(max_epochs=30), *sizes, Randomness(seed), torch.device("cpu"), precision
            )
            for precision in (torch.float32, torch.bfloat16)
        )
        fresh = least_correlation(exact(inputs), rounded(inputs))
        exact.fit(preferences(inputs, rewards, seed))
        rounded.load(exact.state())
        fitted = least_correlation(exact(inputs), rounded(inputs))
        yield {"task": task, "seed": seed, "fresh": round(fresh, 5), "fitted": round(fitted, 5)}


def main() -> None:
    torch.set_num_threads(1)
    rows = [row for task in TASKS for row in measured(task)]
    (RESULTS / "rank_correlation.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    print("| task | fresh | after a fit |\n|---|---|---|")
    for task in TASKS:
        mine = [row for row in rows if row["task"] == task]
        print(f"| {task} | {min(row['fresh'] for row in mine)} | {min(row['fitted'] for row in mine)} |")


if __name__ == "__main__":
    main()
