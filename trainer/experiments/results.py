"""What an experiment came to: one row an evaluation, as Parquet."""

from __future__ import annotations

import io
import json
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
from sqlalchemy.orm import Session

from labels_db.data_folder import DataFolder
from labels_db.experiments import Experiment, done_elsewhere, runs_of_experiment
from labels_db.feedback_progress import feedback_progress_of
from labels_db.models import Run, RunState
from labels_db.records import evaluations_of

JOINED = "joined.parquet"
Row = dict[str, Any]
"""What one evaluation found, and of which run."""
Curve = list[tuple[int, float]]
"""(step, value) of every evaluation of one run."""


def results_folder(experiment: Experiment, data: DataFolder) -> Path:
    folder = data.path / "experiments" / experiment.name
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def write_results(experiment: Experiment, data: DataFolder) -> Path:
    """Everything recorded so far of the experiment's runs, and what was joined; returns the folder."""
    folder = results_folder(experiment, data)
    joined = joined_rows(experiment, data)
    own, elsewhere = _own_rows(experiment, data, {row["run"] for row in joined})
    _write(folder / "results.parquet", [*own, *(row for row in joined if row["run"] in elsewhere)])
    return folder


def joined_rows(experiment: Experiment, data: DataFolder) -> list[Row]:
    """What was taken from other results."""
    path = results_folder(experiment, data) / JOINED
    return pq.read_table(path).to_pylist() if path.exists() else []


def add_joined(experiment: Experiment, data: DataFolder, rows: Sequence[Row]) -> None:
    """Beside what was taken before, but instead of what it said of the same runs."""
    runs = {row["run"] for row in rows}
    kept = [row for row in joined_rows(experiment, data) if row["run"] not in runs]
    _write(results_folder(experiment, data) / JOINED, [*kept, *rows])


def _write(path: Path, rows: Sequence[Row]) -> None:
    if rows:
        columns = dict.fromkeys(name for row in rows for name in row)  # a task's own measures too
        file = io.BytesIO()
        pq.write_table(pa.table({name: [row.get(name) for row in rows] for name in columns}), file)
        written_whole(path, file.getvalue())


def written_whole(path: Path, content: bytes) -> None:
    """Whole or not at all."""
    partial = path.with_name(f"{path.name}.part")
    partial.write_bytes(content)
    partial.replace(path)


def _own_rows(
    experiment: Experiment, data: DataFolder, joined: Collection[str]
) -> tuple[list[Row], set[str]]:
    """Rows of the runs here, but for those of which the joined ones count; and the names of these."""
    with data.open_database() as database, database.read() as session:
        elsewhere = done_elsewhere(session, joined)
        runs = [run for run in runs_of_experiment(session, experiment.name) if run.id not in elsewhere]
        rows = list(_rows(session, runs))
    return rows, elsewhere


def _rows(session: Session, runs: Sequence[Run]) -> Iterator[Row]:
    progress = feedback_progress_of(session, runs)
    for run in runs:
        known = {**_of_the_run(run), "answers": progress[run.id].preferences}
        for lived in evaluations_of(session, run.id):
            yield {**known, "step": lived.step, "return": lived.mean_return, **lived.measures}


def _of_the_run(run: Run) -> Row:
    return {
        "run": run.id,
        "task": run.preset,
        "method": run.method,
        "seed": run.config["seed"],
        "budget": run.config["feedback"].get("budget", 0),
        "total_steps": run.config["total_steps"],
        "state": run.state.value,
        "config": json.dumps(run.config),
    }


class Results:
    """The rows of an experiment, by task, method and seed."""

    def __init__(self, rows: list[Row]) -> None:
        self.rows = rows

    @classmethod
    def read(cls, folder: Path, experiment: Experiment) -> Results:
        """Of the runs that the experiment plans now; FileNotFoundError where no results have been written yet."""
        planned = {one.run_id for one in experiment.planned()}
        rows = pq.read_table(folder / "results.parquet").to_pylist()
        return cls([row for row in rows if row["run"] in planned])

    def has(self, task: str) -> bool:
        return any(row["task"] == task for row in self.rows)

    def curves(self, task: str, method: str, measure: str) -> Mapping[int, Curve]:
        """Each seed's curve."""
        found: dict[int, Curve] = defaultdict(list)
        for row in self._of(task, method):
            if row.get(measure) is not None:
                found[row["seed"]].append((row["step"], row[measure]))
        return {seed: sorted(curve) for seed, curve in sorted(found.items())}

    def comparable(self, task: str, method: str, measure: str) -> Mapping[int, Curve]:
        """The curves of finished seeds; of all while none has finished, or one under way would cut the others off."""
        found, over = self.curves(task, method, measure), self.last(task, method, measure)
        return {seed: curve for seed, curve in found.items() if seed in over} or found

    def last(self, task: str, method: str, measure: str) -> Mapping[int, float]:
        """The value at the last evaluation of each seed that has finished."""
        over = {row["seed"] for row in self._finished(task, method)}
        curves = self.curves(task, method, measure)
        return {seed: curve[-1][1] for seed, curve in curves.items() if seed in over}

    def steps(self, task: str, method: str) -> int:
        """The steps that each of its finished runs had."""
        return max((int(row["total_steps"]) for row in self._finished(task, method)), default=0)

    def answers(self, task: str, method: str) -> float:
        """Preferences that a finished seed learned from, on average."""
        by_seed = {row["seed"]: row["answers"] for row in self._finished(task, method)}
        return float(sum(by_seed.values())) / max(len(by_seed), 1)

    def _finished(self, task: str, method: str) -> list[Row]:
        return [row for row in self._of(task, method) if row["state"] == RunState.FINISHED]

    def _of(self, task: str, method: str) -> Iterator[Row]:
        return (row for row in self.rows if (row["task"], row["method"]) == (task, method))
