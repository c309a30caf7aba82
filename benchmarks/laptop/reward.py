"""How a laptop's reward model learns most from few answers: `python -m benchmarks.laptop.reward DATA …`.

The queries of every run in those data folders are answered again by a perfectly rational teacher and learned in their
order, session by session, with other settings. After each fit the reward model is asked about the session to come: the
rank correlation of r̂ with the true reward over its steps, and the accuracy on its pairs. Sessions that decide nothing
are not asked about. Take runs that chose their queries uniformly: others chose what their own model was unsure of.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from scipy.stats import spearmanr
from sqlalchemy import select
from torch import Tensor

from labels_db.data_folder import DataFolder
from labels_db.feedback_sessions import session_queries
from labels_db.history import sessions_of
from labels_db.models import Query, Run, Segment
from labels_db.run_config import LearnedReward
from labels_db.runs import config_of, get_run
from labels_db.storage import ArtifactStore
from trainer.arithmetic import set_up_arithmetic
from trainer.experiments.provenance import versions
from trainer.randomness import Randomness
from trainer.reward_model import Preferences, RewardModel
from trainer.segments import inputs_from_bytes, rewards_from_bytes

RESULTS = Path(__file__).parent.parent / "results"
SEEDS = (1, 2)
LAPTOP = LearnedReward(batch_size=32)
SETTINGS: dict[str, dict[str, Any]] = {
    "3×256": {"depth": 3},
    "2×256": {"depth": 2},
    "2×128": {"width": 128, "depth": 2},
    "1×512": {"width": 512, "depth": 1},
    "1×256": {"depth": 1},
    "1×128": {"width": 128, "depth": 1},
    "1×256, 50 epochs": {"stop_accuracy": 1, "depth": 1},
    "1×256, batches of 8": {"batch_size": 8, "depth": 1},
    "1×256, batches of 8, 50 epochs": {"stop_accuracy": 1, "batch_size": 8, "depth": 1},
}
"""What is varied: hidden layers, batches, and whether a fit ends where 97 % are right."""


@dataclass(frozen=True)
class Asked:
    """One session: its pairs as a perfectly rational teacher answers them, and every step's true reward [2·n·H]."""

    preferences: Preferences
    rewards: Tensor

    @property
    def inputs(self) -> Tensor:
        """[2·n·H, D + A]."""
        return torch.cat([self.preferences.first, self.preferences.second]).flatten(0, 1)


def asked_in(data: DataFolder, run_id: str) -> tuple[str, list[Asked]]:
    """The run's environment and its sessions, in order."""
    store = data.open_store()
    with data.open_database() as database, database.read() as session:
        environment = config_of(get_run(session, run_id)).environment.name
        numbers = [record.session.id for record in sessions_of(session, run_id)]
        sessions = [_asked(store, session_queries(session, number)) for number in numbers]
    return environment, sessions


def _asked(store: ArtifactStore, queries: Sequence[Query]) -> Asked:
    sides = [
        [_step_data(store, query.first) for query in queries],
        [_step_data(store, query.second) for query in queries],
    ]
    first, second = (torch.stack([inputs for inputs, _ in side]) for side in sides)
    rewards = [torch.stack([rewards for _, rewards in side]) for side in sides]
    label = 0.5 + 0.5 * torch.sign(rewards[1].sum(1) - rewards[0].sum(1))
    return Asked(Preferences(first, second, label), torch.cat(rewards).flatten())


def _step_data(store: ArtifactStore, segment: Segment) -> tuple[Tensor, Tensor]:
    """Inputs [H, D + A] and true rewards [H]."""
    stored = store.read(segment.artifact_key, segment.checksum)
    return torch.from_numpy(inputs_from_bytes(stored)), torch.from_numpy(rewards_from_bytes(stored))


def learned(config: LearnedReward, sessions: list[Asked], seed: int) -> dict[str, Any]:
    """What fits of all sessions but the last came to, each asked about the one after it."""
    inputs = sessions[0].inputs.shape[-1]
    model = RewardModel(config, inputs, 0, Randomness(seed), torch.device("cpu"))
    correlations, accuracies, began = [], [], time.process_time()
    for known, coming in enumerate(sessions[1:], start=1):
        model.fit(_joined([session.preferences for session in sessions[:known]]))
        if bool((coming.preferences.label == 0.5).all()):
            continue
        correlations.append(float(spearmanr(model(coming.inputs), coming.rewards).statistic))
        accuracies.append(model.accuracy(coming.preferences))
    seconds = time.process_time() - began
    return {"correlations": correlations, "accuracies": accuracies, "seconds": seconds}


def _joined(parts: list[Preferences]) -> Preferences:
    return Preferences(
        *(torch.cat([getattr(part, name) for part in parts]) for name in ("first", "second", "label"))
    )


def runs_in(data: DataFolder) -> list[str]:
    with data.open_database() as database, database.read() as session:
        return list(session.scalars(select(Run.id).order_by(Run.id)))


def compared(data: DataFolder, run_id: str) -> Iterator[dict[str, Any]]:
    """A row for each setting and seed."""
    task, sessions = asked_in(data, run_id)
    for name, settings in SETTINGS.items():
        reward = LAPTOP.model_copy(update=settings)
        for seed in SEEDS:
            row = learned(reward, sessions, seed)
            yield {"task": task, "run": run_id, "setting": name, "seed": seed, **row}


def table(rows: list[dict[str, Any]]) -> str:
    """A line for each setting, in Markdown: means over sessions, runs and seeds."""
    tasks = list(dict.fromkeys(row["task"] for row in rows))
    head = [f"{task}: rank correlation | accuracy | seconds" for task in tasks]
    lines = ["| reward model | " + " | ".join(head) + " |", "|---" * (1 + 3 * len(tasks)) + "|"]
    for name in SETTINGS:
        mine = [[row for row in rows if (row["task"], row["setting"]) == (task, name)] for task in tasks]
        lines.append(f"| {name} | " + " | ".join(map(_cells, mine)) + " |")
    return "\n".join(lines)


def _cells(rows: list[dict[str, Any]]) -> str:
    means = [
        np.mean([np.mean(row[column]) for row in rows])
        for column in ("correlations", "accuracies", "seconds")
    ]
    return f"{means[0]:.2f} | {means[1]:.2f} | {means[2]:.0f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", nargs="+", type=Path)
    chosen = parser.parse_args()
    set_up_arithmetic(1)
    folders = [DataFolder(path) for path in chosen.data]
    rows = [row for data in folders for run in runs_in(data) for row in compared(data, run)]
    written = json.dumps({"versions": versions(), "rows": rows}, indent=1)
    (RESULTS / "reward-settings.json").write_text(written + "\n", encoding="utf-8")
    print(table(rows))


if __name__ == "__main__":
    main()
