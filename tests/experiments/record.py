"""What tests read of an experiment's runs."""

from __future__ import annotations

from labels_db.data_folder import DataFolder
from labels_db.experiments import runs_of_experiment
from labels_db.models import RunState


def states(data: DataFolder, experiment: str) -> dict[str, RunState]:
    database = data.open_database()
    with database.read() as session:
        found = {run.id: run.state for run in runs_of_experiment(session, experiment)}
    database.close()
    return found
