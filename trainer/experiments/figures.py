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
from trainer.experiments.drawing import COLOURS, Drawing
from trainer.experiments.pictures import query_sheet, strips
from trainer.experiments.results import Curve, Results
from trainer.experiments.statistics import bootstrap_interval, interquartile_mean
from trainer.experiments.tables import differences, ends

PANELS_ACROSS = 3
DPI = 150


def draw_all(
    figures: Iterable[Figure], experiment: Experiment, results: Results, data: DataFolder, folder: Path
) -> Iterator[Path]:
    """Those figures of the experiment; yields each file as it is written."""
    mpl.use("Agg")
    folder.mkdir(parents=True, exist_ok=True)
    drawing = Drawing(experiment, results, data, folder)
    for figure in figures:
        yield DRAWERS[type(figure)](figure, drawing)


def curves(figure: Curves, drawing: Drawing) -> Path:
    """A panel for each task."""
    tasks = drawing.tasks(figure.tasks)
    panels = _panels(len(tasks))
    methods = list(dict.fromkeys([*drawing.methods(figure.methods), *figure.asymptotes]))
    for axes, task in zip(panels, tasks, strict=True):
        for method in methods:
            _curve(axes, figure, task, method, drawing)
        axes.set(title=preset_named(task).title, xlabel="steps of the agent", ylabel=figure.measure)
        if _labelled(axes):
            axes.legend(fontsize=8)
    _refuse_nothing(panels, figure.file, figure.measure)
    return _saved(panels[0].figure, drawing.path(figure))


def _curve(axes: Any, figure: Curves, task: str, method: str, drawing: Drawing) -> None:
    """The method's line; as an asymptote, only where it ends."""
    style = drawing.style(method)
    if method in figure.asymptotes:
        ends = list(drawing.results.last(task, method, figure.measure).values())
        if ends:
            end = SPREADS[figure.statistic](np.array(ends)[:, None])[0][0]
            label = f"{method} ({len(ends)}), at its end"
            axes.axhline(end, **{**style, "linestyle": ":"}, linewidth=1.5, label=label)
    elif found := drawing.results.comparable(task, method, figure.measure):
        steps, values = aligned(list(found.values()))
        middle, low, high = SPREADS[figure.statistic](values)
        axes.plot(steps, middle, **style, linewidth=1.6, label=f"{method} ({len(values)})")
        axes.fill_between(steps, low, high, color=style["color"], alpha=0.18, linewidth=0)


def _refuse_nothing(panels: list[Any], file: str, measure: str) -> None:
    """ValueError instead of an empty picture."""
    if not any(map(_labelled, panels)):
        raise ValueError(f"{file}: no run has an evaluation with the measure {measure!r} yet")


def _labelled(axes: Any) -> bool:
    return bool(axes.get_legend_handles_labels()[0])


def aligned(found: list[Curve]) -> tuple[Any, Any]:
    """Steps [t] that every curve has, and values there [n, t]."""
    steps = sorted(set.intersection(*({step for step, _ in curve} for curve in found)))
    return np.array(steps), np.array([[dict(curve)[step] for step in steps] for curve in found])


def _mean_and_deviation(values: Any) -> tuple[Any, Any, Any]:
    mean, deviation = values.mean(0), values.std(0)
    return mean, mean - deviation, mean + deviation


def _iqm_and_interval(values: Any) -> tuple[Any, Any, Any]:
    return interquartile_mean(values.T), *bootstrap_interval(values.T)


SPREADS = {"mean": _mean_and_deviation, "iqm": _iqm_and_interval}


def budgets(figure: Budgets, drawing: Drawing) -> Path:
    """The last values of every method at its number of labels."""
    (axes,) = _panels(1)
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
    _refuse_nothing([axes], figure.file, figure.measure)
    axes.legend(fontsize=8)
    return _saved(axes.figure, drawing.path(figure))


def frame_strips(figure: Strips, drawing: Drawing) -> Path:
    """A row for each task and method: the best run that finished here, as its last policy does it."""
    rows = []
    for task, method, runs in drawing.runs_here(figure):
        last = drawing.results.last(task, method, figure.measure)
        ended = [seed for seed in last if seed in runs and runs[seed].state is RunState.FINISHED]
        if ended:
            best = max(ended, key=lambda seed: last[seed])
            rows.append((f"{preset_named(task).title} · {method}, seed {best}", runs[best].id))
    return strips(rows, drawing.data, figure, drawing.path(figure))


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


def _panels(count: int) -> list[Any]:
    from matplotlib import pyplot

    across = min(count, PANELS_ACROSS)
    down = -(-count // across)
    figure, grid = pyplot.subplots(
        down, across, figsize=(4.6 * across, 3.6 * down), squeeze=False, sharey=True, layout="constrained"
    )
    panels = list(grid.flat)
    for unused in panels[count:]:
        unused.remove()
    for axes in panels[:count]:
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(alpha=0.25)
    del figure
    return panels[:count]


def _saved(figure: Any, path: Path) -> Path:
    from matplotlib import pyplot

    figure.savefig(path, dpi=DPI)
    pyplot.close(figure)
    return path
