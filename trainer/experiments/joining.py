"""Results of other machines and of earlier sittings: an experiment may be lived through in parts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pydantic import ValidationError

from labels_db.config_differences import config_differences
from labels_db.data_folder import DataFolder
from labels_db.experiments import Experiment, PlannedRun
from labels_db.models import RunState
from labels_db.run_config import RunConfig
from trainer.experiments.file import ExperimentError
from trainer.experiments.provenance import Versions, join_versions, kept_versions
from trainer.experiments.results import Results, Row, add_joined, joined_rows


def join_results(experiment: Experiment, data: DataFolder, folders: Sequence[Path]) -> None:
    """Take the finished runs of those results folders, so that they are not lived through here.

    Of a run that several have the last one's counts. ExperimentError, and nothing taken, where a folder has none
    or its runs had other settings.
    """
    for rows, versions in [_part(experiment, folder) for folder in folders]:
        join_versions(experiment, data, versions)
        add_joined(experiment, data, rows)


def joined_runs(experiment: Experiment, data: DataFolder) -> set[str]:
    """What has been joined of the runs planned; ExperimentError where one had other settings than it has now."""
    planned = {one.run_id for one in experiment.planned()}
    rows = [row for row in joined_rows(experiment, data) if row["run"] in planned]
    _check(experiment, rows, "joined results")
    return {row["run"] for row in rows}


def _part(experiment: Experiment, folder: Path) -> tuple[list[Row], Versions]:
    """The rows of finished runs that the experiment plans, and the versions that lived through them."""
    try:
        rows = Results.read(folder, experiment).rows
        versions = kept_versions(folder)
        finished = [row for row in rows if row["state"] == RunState.FINISHED]
    except (OSError, ValueError, KeyError) as error:
        raise ExperimentError(f"{folder}: {_NO_RESULTS} ({error})") from error
    if not finished:
        raise ExperimentError(f"{folder}: holds no finished run of experiment {experiment.name!r}")
    _check(experiment, finished, str(folder))
    return finished, versions


_NO_RESULTS = "is no folder of results to join; give DATA/experiments/NAME of the other machine"


def _check(experiment: Experiment, rows: Sequence[Row], place: str) -> None:
    configs = {row["run"]: row.get("config") for row in rows}
    for planned in experiment.planned():
        if planned.run_id in configs and (differing := _differing(planned, configs[planned.run_id])):
            raise ExperimentError(
                f"{place}: {planned.run_id} was run with other settings ({differing});"
                " give the experiment another name"
            )


def _differing(planned: PlannedRun, config: str | None) -> str:
    """The settings that are not those of the plan, in words; nothing where all are."""
    if config is None:
        return "they were not kept"
    try:
        had = RunConfig.model_validate_json(config)
    except ValidationError as error:
        return f"{error.error_count()} of them unknown"
    return ", ".join(one.path for one in config_differences([had, planned.config]))
