"""Results of other machines and of earlier sittings: an experiment may be lived through in parts."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from labels_db.config_differences import config_differences
from labels_db.data_folder import DataFolder
from labels_db.experiments import Experiment, PlannedRun
from labels_db.models import RunState
from labels_db.run_config import RunConfig
from trainer.experiments.file import ExperimentError
from trainer.experiments.provenance import join_versions
from trainer.experiments.results import Results, Row, joined_rows, write_joined


def join_results(experiment: Experiment, data: DataFolder, folders: Sequence[Path]) -> None:
    """Take the finished runs of those results, so that they are not lived through here again.

    The first folder that has a run is the one believed. ExperimentError, and nothing taken, where a folder
    has no results or its runs had other settings.
    """
    parts = [joined_rows(experiment, data), *(_finished(experiment, folder) for folder in folders)]
    write_joined(experiment, data, list(_each_run_once(parts)))
    for folder in folders:
        join_versions(experiment, data, folder)


def _each_run_once(parts: Sequence[Sequence[Row]]) -> Iterator[Row]:
    seen: set[str] = set()
    for rows in parts:
        yield from (row for row in rows if row["run"] not in seen)
        seen |= {row["run"] for row in rows}


def _finished(experiment: Experiment, folder: Path) -> list[Row]:
    """Its rows of finished runs that the experiment plans, every one with the settings planned."""
    try:
        rows = Results.read(folder, experiment).rows
        configs = json.loads((folder / "configurations.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ExperimentError(f"{folder}: holds no results that could be joined: {error}") from error
    rows = [row for row in rows if row["state"] == RunState.FINISHED]
    for planned in _examples(experiment, {(row["task"], row["method"]) for row in rows}):
        _check(planned, configs, folder)
    return rows


def _examples(experiment: Experiment, had: set[tuple[str, str]]) -> Iterator[PlannedRun]:
    """Of each task and method the first seed's run, whose settings are kept beside results."""
    for one in experiment.planned():
        if one.seed == experiment.seeds[0] and (one.task, one.compared.name) in had:
            yield one


def _check(planned: PlannedRun, configs: Mapping[str, Any], folder: Path) -> None:
    try:
        had = RunConfig.model_validate(configs[planned.run_id])
    except (KeyError, ValidationError) as error:
        raise ExperimentError(f"{folder}: does not tell the settings of {planned.run_id}: {error}") from error
    if changed := config_differences([had, planned.config]):
        names = ", ".join(one.path for one in changed)
        raise ExperimentError(f"{folder}: {planned.run_id} was run with other settings ({names})")
