"""What an experiment came to: one row an evaluation, as Parquet beside the configuration and the versions."""

from __future__ import annotations

import json
import platform
from collections import defaultdict
from collections.abc import Iterator, Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from labels_db.data_folder import DataFolder
from labels_db.experiments import Experiment, runs_of_experiment
from labels_db.models import Run
from labels_db.records import evaluations_of

PACKAGES = (
    "pebble-teach",
    "torch",
    "numpy",
    "mujoco",
    "dm-control",
    "gymnasium",
    "metaworld",
    "stable-baselines3",
)

Curve = list[tuple[int, float]]
"""(step, value) of every evaluation of one run."""


def write_results(experiment: Experiment, data: DataFolder) -> Path:
    """Everything recorded so far of the experiment's runs; returns the folder."""
    folder = data.path / "experiments" / experiment.name
    folder.mkdir(parents=True, exist_ok=True)
    rows = list(_rows(experiment, data))
    if rows:
        pq.write_table(pa.Table.from_pylist(rows), folder / "results.parquet")
    (folder / "experiment.json").write_text(experiment.model_dump_json(indent=1) + "\n", encoding="utf-8")
    (folder / "versions.json").write_text(json.dumps(versions(), indent=1) + "\n", encoding="utf-8")
    return folder


def _rows(experiment: Experiment, data: DataFolder) -> Iterator[dict[str, Any]]:
    database = data.open_database()
    with database.read() as session:
        for run in runs_of_experiment(session, experiment.name):
            known = _of_the_run(run)
            for lived in evaluations_of(session, run.id):
                yield {**known, "step": lived.step, "return": lived.mean_return, **lived.measures}
    database.close()


def _of_the_run(run: Run) -> dict[str, Any]:
    return {
        "run": run.id,
        "task": run.preset,
        "method": run.method,
        "seed": run.config["seed"],
        "budget": run.config["feedback"].get("budget", 0),
        "total_steps": run.config["total_steps"],
        "state": run.state.value,
    }


def versions() -> dict[str, str]:
    """Of Python, this program and the libraries that results depend on."""
    found = {"python": platform.python_version(), "machine": platform.machine()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


class Results:
    """The rows of an experiment, by task, method and seed."""

    def __init__(self, rows: list[dict[str, Any]]) -> None:
        self.rows = rows

    @classmethod
    def read(cls, folder: Path) -> Results:
        """FileNotFoundError where no results have been written yet."""
        return cls(pq.read_table(folder / "results.parquet").to_pylist())

    def curves(self, task: str, method: str, measure: str) -> Mapping[int, Curve]:
        """Each seed's curve."""
        found: dict[int, Curve] = defaultdict(list)
        for row in self.rows:
            if (row["task"], row["method"]) == (task, method) and row.get(measure) is not None:
                found[row["seed"]].append((row["step"], row[measure]))
        return {seed: sorted(curve) for seed, curve in sorted(found.items())}

    def last(self, task: str, method: str, measure: str) -> Mapping[int, float]:
        """Each seed's value at its last evaluation."""
        return {seed: curve[-1][1] for seed, curve in self.curves(task, method, measure).items()}

    def budget(self, task: str, method: str) -> int:
        """Labels that the method was given on the task."""
        return max((r["budget"] for r in self.rows if (r["task"], r["method"]) == (task, method)), default=0)
