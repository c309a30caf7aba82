"""The paper's figures from an experiment's results: `draw` writes each as an image, or as a table."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from types import MappingProxyType
from typing import Any

import matplotlib as mpl
import numpy as np

from labels_db.data_folder import DataFolder
from labels_db.experiments import Experiment
from labels_db.figures import Budgets, Curves, Differences, Ends, Figure, Queries, Strips
from labels_db.models import RunState
from labels_db.presets import preset_named
from trainer.checkpoints import CheckpointError
from trainer.experiments.curves import curves
from trainer.experiments.drawing import COLOURS, Drawing
from trainer.experiments.panels import NothingToShowError, panels, refuse_nothing, saved
from trainer.experiments.pictures import Row, query_sheet, strips
from trainer.experiments.results import Results
from trainer.experiments.tables import differences, ends


def draw_all(
    figures: Iterable[Figure], experiment: Experiment, results: Results, data: DataFolder, folder: Path
) -> Iterator[tuple[Path, str]]:
    """Those figures of the experiment: yields the file of each, and why it could not be drawn or an empty text."""
    mpl.use("Agg")
    folder.mkdir(parents=True, exist_ok=True)
    drawing = Drawing(experiment, results, data, folder)
    for figure in figures:
        try:
            yield DRAWERS[type(figure)](figure, drawing), ""
        except (NothingToShowError, CheckpointError) as nothing:
            yield drawing.path(figure), str(nothing)


def budgets(figure: Budgets, drawing: Drawing) -> Path:
    """The last values of every method at its number of labels."""
    (axes,) = panels(1)
    for colour, task in zip(itertools.cycle(COLOURS), drawing.tasks(figure.tasks), strict=False):
        points = []
        for method in drawing.methods(figure.methods):
            last = list(drawing.results.last(task, method, figure.measure).values())
            if last:
                points.append((drawing.results.answers(task, method), np.mean(last), np.std(last)))
        if points:
            labels, means, deviations = zip(*sorted(points), strict=True)
            title = preset_named(task).title
            axes.errorbar(labels, means, deviations, marker="o", capsize=3, color=colour, label=title)
    axes.set(xlabel="labels", ylabel=f"{figure.measure} at the end")
    refuse_nothing([axes], figure.measure)
    axes.legend(fontsize=8)
    return saved(axes.figure, drawing.path(figure))


def frame_strips(figure: Strips, drawing: Drawing) -> Path:
    """A row for each task and method: the best run that finished here, as its last policy does it."""
    rows = []
    for task, method, runs in drawing.runs_here(figure):
        best_by = figure.best_by.get(task, figure.measure)
        last = drawing.results.last(task, method, best_by)
        ended = [seed for seed in last if seed in runs and runs[seed].state is RunState.FINISHED]
        if ended:
            best = max(ended, key=lambda seed: last[seed])
            told = drawing.results.last(task, method, figure.measure).get(best)
            came_to = "" if told is None else f": {figure.measure} {told:.3g}"
            title = f"{preset_named(task).title} · {method}, seed {best}{came_to}"
            rows.append(Row(title, runs[best].id, best_by))
    return strips(rows, drawing.data, figure.frames, drawing.path(figure))


def queries(figure: Queries, drawing: Drawing) -> Path:
    """What the first seed here of each method was asked in some of its sessions."""
    runs = []
    for task, method, by_seed in drawing.runs_here(figure):
        seed, run = next(iter(by_seed.items()))
        runs.append((f"{task} · {method}, seed {seed}", run.id))
    return query_sheet(runs, drawing.data, figure.sessions, figure.queries, drawing.path(figure))


DRAWERS: MappingProxyType[type, Callable[[Any, Drawing], Path]] = MappingProxyType(
    {
        Curves: curves,
        Budgets: budgets,
        Ends: ends,
        Differences: differences,
        Strips: frame_strips,
        Queries: queries,
    }
)
