"""Living through an experiment: N runs at a time on this machine, until none is left.

A killed experiment is simply run again: what has finished stays, what was under way goes on from its last
checkpoint. Its runs are runs like any other, so the dashboard shows them and a server may look on.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from labels_db.data_folder import DataFolder
from labels_db.database import Database
from labels_db.experiments import Experiment, request_experiment, runs_of_experiment
from labels_db.models import Run, RunState
from trainer.experiments.provenance import write_provenance
from trainer.experiments.results import joined_rows
from trainer.launcher import LocalLauncher
from trainer.supervisor import LOOK_SECONDS, Supervisor

OVER = {RunState.FINISHED, RunState.FAILED, RunState.STOPPED}


@dataclass(frozen=True)
class Standing:
    """Every run of the experiment at this moment: those here, and how many were joined from other results."""

    runs: Sequence[Run]
    joined: int

    @property
    def planned(self) -> int:
        return len(self.runs) + self.joined

    @property
    def over(self) -> bool:
        return all(run.state in OVER for run in self.runs)

    @property
    def failed(self) -> list[str]:
        return [run.id for run in self.runs if run.state is RunState.FAILED]

    @property
    def finished(self) -> int:
        return sum(run.state is RunState.FINISHED for run in self.runs) + self.joined


def run_experiment(
    experiment: Experiment,
    data: DataFolder,
    *,
    parallel: int,
    leave: threading.Event,
    show: Callable[[Standing], None],
) -> Standing:
    """Until every run has ended or `leave` is set; then each run under way writes its checkpoint."""
    database = data.open_database()
    with database.write() as session:
        request_experiment(session, experiment, {row["run"] for row in joined_rows(experiment, data)})
    if not _standing(database, experiment).over:  # what finished long ago was by the versions of then
        write_provenance(experiment, data)
    supervisor = Supervisor(data, database, LocalLauncher(data), parallel, leave, experiment=experiment.name)
    try:
        while not (standing := _standing(database, experiment)).over and not leave.is_set():
            show(standing)
            supervisor.look()
            leave.wait(LOOK_SECONDS)
        supervisor.end_children()
        show(standing := _standing(database, experiment))
        return standing
    finally:
        database.close()


def _standing(database: Database, experiment: Experiment) -> Standing:
    names = {planned.run_id for planned in experiment.planned()}
    with database.read() as session:
        runs = [run for run in runs_of_experiment(session, experiment.name) if run.id in names]
    return Standing(runs, joined=len(names) - len(runs))
