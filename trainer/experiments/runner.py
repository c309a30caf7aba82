"""Living through an experiment: N runs at a time on this machine, until none is left.

A killed experiment is simply run again: what has finished stays, what was under way goes on from its last
checkpoint. Its runs are runs like any other, so the dashboard shows them and a server may look on.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

from labels_db.data_folder import DataFolder
from labels_db.database import Database
from labels_db.experiments import Experiment, done_elsewhere, request_experiment, runs_of_experiment
from labels_db.models import ENDED, Run, RunState
from trainer.experiments.joining import joined_runs
from trainer.experiments.provenance import write_plan, write_versions
from trainer.experiments.results import write_results
from trainer.launcher import LocalLauncher
from trainer.supervisor import LOOK_SECONDS, Supervisor


@dataclass(frozen=True)
class ExperimentRuns:
    """Every run of the experiment at this moment: those here, and how many were joined from other results."""

    runs: Sequence[Run]
    joined: int

    @property
    def planned(self) -> int:
        return len(self.runs) + self.joined

    @property
    def over(self) -> bool:
        return all(run.state in ENDED for run in self.runs)

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
    show: Callable[[ExperimentRuns], None],
) -> ExperimentRuns:
    """Until every run has ended or `leave` is set; then each run under way writes its checkpoint.

    Results are written whenever a run has finished. ExperimentError where joined ones had other settings.
    """
    joined = joined_runs(experiment, data)
    database = data.open_database()
    with database.write() as session:
        elsewhere = done_elsewhere(session, joined)
        request_experiment(session, experiment, elsewhere)
    write_plan(experiment, data)
    # What finished long ago was by the versions of then.
    if not _runs_now(database, experiment, elsewhere).over:
        write_versions(experiment, data)
    supervisor = Supervisor(data, database, LocalLauncher(data), parallel, leave, experiment=experiment.name)
    finished = 0
    try:
        while not (now := _runs_now(database, experiment, elsewhere)).over and not leave.is_set():
            show(now)
            if now.finished > finished:  # a machine may be gone without a word
                finished = now.finished
                write_results(experiment, data)
            supervisor.look()
            leave.wait(LOOK_SECONDS)
        supervisor.end_children()
        show(now := _runs_now(database, experiment, elsewhere))
        return now
    finally:
        write_results(experiment, data)
        database.close()


def _runs_now(database: Database, experiment: Experiment, elsewhere: Collection[str]) -> ExperimentRuns:
    names = {planned.run_id for planned in experiment.planned()} - set(elsewhere)
    with database.read() as session:
        here = [run for run in runs_of_experiment(session, experiment.name) if run.id in names]
    return ExperimentRuns(here, joined=len(elsewhere))
