"""What every figure of an experiment is made from."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from labels_db.data_folder import DataFolder
from labels_db.experiments import Experiment, runs_of_experiment
from labels_db.figures import Figure, Queries, Strips
from labels_db.models import Run
from trainer.experiments.results import Results

COLOURS = ("#2b6cb0", "#c05621", "#2f855a", "#805ad5", "#b83280", "#718096", "#975a16", "#00838f", "#c53030")

LINES = ("-", "--", "-.")
Style = dict[str, str]
"""Colour and kind of a line, as matplotlib takes them."""


@dataclass(frozen=True)
class Drawing:
    """What a figure is drawn from, and where to."""

    experiment: Experiment
    results: Results
    data: DataFolder
    folder: Path

    def path(self, figure: Figure) -> Path:
        return self.folder / figure.path

    def methods(self, wanted: list[str] | None) -> list[str]:
        return wanted or [one.name for one in self.experiment.compared]

    def tasks(self, wanted: list[str] | None) -> list[str]:
        return wanted or self.experiment.tasks

    def runs_here(self, figure: Strips | Queries) -> Iterator[tuple[str, str, dict[int, Run]]]:
        """Of each task and method shown, the runs by seed that the data folder has: of joined ones it has results."""
        with self.data.open_database() as database, database.read() as session:
            here = {run.id: run for run in runs_of_experiment(session, self.experiment.name)}
        planned = [one for one in self.experiment.planned() if one.run_id in here]
        for task, method in product(self.tasks(figure.tasks), self.methods(figure.methods)):
            same = [one for one in planned if (one.task, one.compared.name) == (task, method)]
            if same:
                yield task, method, {one.seed: here[one.run_id] for one in same}

    def compared_on(self, task: str) -> set[str]:
        """Methods that do not keep to other tasks."""
        return {one.name for one in self.experiment.compared if one.runs_on(task)}

    def style(self, method: str) -> Style:
        """The same in every figure of the experiment, and no other method's."""
        place = [one.name for one in self.experiment.compared].index(method)
        round_, colour = divmod(place, len(COLOURS))
        return {"color": COLOURS[colour], "linestyle": LINES[round_ % len(LINES)]}
