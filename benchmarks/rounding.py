"""What rounding to bfloat16 does to a reward model: `python -m benchmarks.rounding`.

Its order: Spearman's correlation of r̂ in float32 and with products in bfloat16, within minibatches of a task's
own states, for a fresh reward model and for the same one after a fit; the least of all minibatches counts.
Its learning: the accuracy on pairs that it has not seen, after fits with products in each precision.
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
from trainer.arithmetic import set_up_arithmetic
from trainer.environments import make_environment
from trainer.experiments.provenance import versions
from trainer.randomness import Randomness
from trainer.reward_model import Preferences, RewardModel

TASKS = (
    "cartpole-swingup",
    "ball_in_cup-catch",
    "reacher-easy",
    "walker-walk",
    "quadruped-walk",
    "drawer-close",
    "window-open",
)
SEEDS = (1, 2, 3)
STEPS, LABELS, HELD_OUT, SEGMENT = 8000, 200, 500, 50
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


def preferences(inputs: torch.Tensor, rewards: torch.Tensor, seed: int, count: int) -> Preferences:
    """What a perfectly rational teacher would say of random pairs."""
    starts = np.random.default_rng(seed).integers(0, STEPS - SEGMENT, (2, count))
    first, second = (torch.stack([inputs[at : at + SEGMENT] for at in side]) for side in starts)
    sums = [torch.stack([rewards[at : at + SEGMENT].sum() for at in side]) for side in starts]
    return Preferences(first, second, (sums[1] > sums[0]).float())


def measured(task: str) -> Iterator[dict[str, Any]]:
    inputs, rewards, sizes = wandered(task)
    unseen = preferences(inputs, rewards, 0, HELD_OUT)
    for seed in SEEDS:
        exact, rounded = (
            RewardModel(
                LearnedReward(max_epochs=30), *sizes, Randomness(seed), torch.device("cpu"), precision
            )
            for precision in (torch.float32, torch.bfloat16)
        )
        fresh = least_correlation(exact(inputs), rounded(inputs))
        learned = preferences(inputs, rewards, seed, LABELS)
        for model in (exact, rounded):
            model.fit(learned)
        accuracies = [model.accuracy(unseen) for model in (exact, rounded)]
        rounded.load(exact.state())
        yield {
            "task": task,
            "seed": seed,
            "fresh": round(fresh, 5),
            "fitted": round(least_correlation(exact(inputs), rounded(inputs)), 5),
            "held_out_float32": accuracies[0],
            "held_out_bfloat16": accuracies[1],
        }


def main() -> None:
    set_up_arithmetic(1)
    rows = [row for task in TASKS for row in measured(task)]
    written = {"versions": versions(), "rows": rows}
    (RESULTS / "rounding.json").write_text(json.dumps(written, indent=1) + "\n", encoding="utf-8")
    print("| task | fresh | after a fit | held out, float32 | held out, bfloat16 |\n|---|---|---|---|---|")
    for task in TASKS:
        mine = [row for row in rows if row["task"] == task]
        least = [str(min(row[name] for row in mine)) for name in ("fresh", "fitted")]
        held_out = [
            ", ".join(f"{row[name]:.3f}" for row in mine)
            for name in ("held_out_float32", "held_out_bfloat16")
        ]
        print(f"| {' | '.join([task, *least, *held_out])} |")


if __name__ == "__main__":
    main()
