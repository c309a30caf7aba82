"""Is it the reward or the policy that falls short? `python -m benchmarks.judging DATA EXPERIMENT`.

The reward that each run has learned judges what the policies of all runs of its task and seed do: the mean of r̂ over
the steps of a few episodes beside their true return. A reward that likes another policy better than its own run's has
been learned well enough to teach more than that run's agent made of it.
"""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from scipy.stats import spearmanr
from torch import Tensor

from labels_db.claims import Claim
from labels_db.data_folder import DataFolder
from labels_db.database import Database
from labels_db.experiments import runs_of_experiment
from labels_db.models import Run, RunState
from labels_db.run_config import LearnedReward
from labels_db.runs import config_of
from labels_db.storage import ArtifactStore
from trainer.arithmetic import set_up_arithmetic
from trainer.checkpoints import Checkpoints
from trainer.environments import make_environment
from trainer.experiments.provenance import versions
from trainer.policy import load_policy
from trainer.randomness import Randomness, derived_seed
from trainer.reward_source import ModelReward, make_reward_source

RESULTS = Path(__file__).parent / "results"
EPISODES = 5


@dataclass(frozen=True)
class Lived:
    """What a policy did in some episodes: inputs of the reward [n, D + A] and true rewards [n]."""

    inputs: Tensor
    rewards: Tensor


def lived(database: Database, store: ArtifactStore, run: Run) -> Lived:
    """Episodes of the run's policy, acting by its mean."""
    policy, environment = load_policy(database, store, run.id), make_environment(config_of(run).environment)
    inputs, rewards = [], []
    for episode in range(EPISODES):
        observation, _ = environment.reset(seed=derived_seed(0, "judging", episode))
        over = False
        while not over:
            action = policy(observation[None])[0]
            inputs.append(np.concatenate([observation, action]))
            observation, reward, terminated, truncated, _ = environment.step(action)
            rewards.append(float(reward))
            over = terminated or truncated
    return Lived(torch.from_numpy(np.stack(inputs)), torch.tensor(rewards))


def learned_reward(database: Database, store: ArtifactStore, run: Run) -> ModelReward:
    """r̂ at the run's end."""
    checkpoints = Checkpoints(database, store, Claim(run.id, 0), config_of(run))
    manifest = checkpoints.latest()
    assert manifest is not None, f"run {run.id} has no checkpoint"
    reward = make_reward_source(config_of(run), Randomness(0), torch.device("cpu"))
    assert isinstance(reward, ModelReward)
    reward.load(checkpoints.state(manifest)["reward"])
    return reward


def judged(data: DataFolder, experiment: str) -> Iterator[dict[str, Any]]:
    """A row for each learned reward and policy of the experiment's finished runs."""
    store = data.open_store()
    with data.open_database() as database:
        with database.read() as session:
            runs = [run for run in runs_of_experiment(session, experiment) if run.state is RunState.FINISHED]
        alike: dict[tuple[str, int], list[Run]] = defaultdict(list)
        for run in runs:
            alike[config_of(run).environment.name, config_of(run).seed].append(run)
        for (task, seed), group in alike.items():
            policies = {run: lived(database, store, run) for run in group}
            for judge in (run for run in group if isinstance(config_of(run).reward, LearnedReward)):
                reward = learned_reward(database, store, judge)
                for run, seen in policies.items():
                    said = reward.model(seen.inputs)
                    yield {
                        "task": task,
                        "seed": seed,
                        "reward": judge.method,
                        "policy": run.method,
                        "true_return": float(seen.rewards.sum()) / EPISODES,
                        "learned": float(said.mean()),
                        "rank_correlation": float(spearmanr(said, seen.rewards).statistic),
                    }


def table(rows: Sequence[dict[str, Any]]) -> str:
    """A line for each learned reward and policy, in Markdown; a value for each seed."""
    lines = ["| task | reward of | policy of | true return | mean r̂ |", "|---" * 5 + "|"]
    told: dict[tuple[str, str, str], list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        told[row["task"], row["reward"], row["policy"]].append(row)
    for names, mine in told.items():
        returns = ", ".join(f"{row['true_return']:.0f}" for row in mine)
        said = ", ".join(f"{row['learned']:.2f}" for row in mine)
        lines.append(f"| {' | '.join([*names, returns, said])} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("experiment")
    chosen = parser.parse_args()
    set_up_arithmetic(1)
    rows = list(judged(DataFolder(chosen.data), chosen.experiment))
    written = json.dumps({"versions": versions(), "rows": rows}, indent=1)
    (RESULTS / chosen.experiment / "judging.json").write_text(written + "\n", encoding="utf-8")
    print(table(rows))


if __name__ == "__main__":
    main()
