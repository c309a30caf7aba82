"""The paper's figures from an experiment's results: `draw` writes each as an image, or as a table."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import matplotlib as mpl
import numpy as np

from labels_db.data_folder import DataFolder
from labels_db.experiments import Budgets, Curves, Differences, Experiment, Queries, Strips
from labels_db.presets import preset_named
from trainer.experiments.pictures import query_sheet, strips
from trainer.experiments.results import Curve, Results
from trainer.experiments.statistics import bootstrap_interval, interquartile_mean, paired_difference

PANELS_ACROSS = 3
COLOURS = ("#2b6cb0", "#c05621", "#2f855a", "#805ad5", "#b83280", "#718096", "#975a16", "#00838f", "#c53030")
DPI = 150


@dataclass(frozen=True)
class Drawing:
    """What a figure is drawn from, and where to."""

    experiment: Experiment
    results: Results
    data: DataFolder
    folder: Path

    def path(self, name: str, ending: str = "png") -> Path:
        return self.folder / f"{name}.{ending}"

    def methods(self, wanted: list[str] | None) -> list[str]:
        return wanted or [one.name for one in self.experiment.compared]

    def colour(self, method: str) -> str:
        """The same in every figure of the experiment."""
        names = [one.name for one in self.experiment.compared]
        return COLOURS[names.index(method) % len(COLOURS)]


def draw_all(experiment: Experiment, results: Results, data: DataFolder, folder: Path) -> Iterator[Path]:
    """Every figure that the experiment asks for; yields each file as it is written."""
    mpl.use("Agg")
    folder.mkdir(parents=True, exist_ok=True)
    drawing = Drawing(experiment, results, data, folder)
    for figure in experiment.figures:
        yield DRAWERS[type(figure)](figure, drawing)


def curves(figure: Curves, drawing: Drawing) -> Path:
    """A panel for each task."""
    tasks = figure.tasks or drawing.experiment.tasks
    panels = _panels(len(tasks))
    methods = list(dict.fromkeys([*drawing.methods(figure.methods), *figure.asymptotes]))
    for axes, task in zip(panels, tasks, strict=True):
        for method in methods:
            _curve(axes, figure, task, method, drawing)
        axes.set(title=preset_named(task).title, xlabel="steps of the agent", ylabel=figure.measure)
        if _labelled(axes):
            axes.legend(fontsize=8)
    _refuse_nothing(panels, figure.file, figure.measure)
    return _saved(panels[0].figure, drawing.path(figure.file))


def _curve(axes: Any, figure: Curves, task: str, method: str, drawing: Drawing) -> None:
    """The method's line; as an asymptote, only where it ends."""
    colour = drawing.colour(method)
    if method in figure.asymptotes:
        ends = list(drawing.results.last(task, method, figure.measure).values())
        if ends:
            end = SPREADS[figure.statistic](np.array(ends)[:, None])[0][0]
            label = f"{method} ({len(ends)}), at its end"
            axes.axhline(end, color=colour, linestyle=":", linewidth=1.5, label=label)
    elif found := drawing.results.comparable(task, method, figure.measure):
        steps, values = aligned(list(found.values()))
        middle, low, high = SPREADS[figure.statistic](values)
        axes.plot(steps, middle, color=colour, linewidth=1.6, label=f"{method} ({len(values)})")
        axes.fill_between(steps, low, high, color=colour, alpha=0.18, linewidth=0)


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
    for colour, task in zip(itertools.cycle(COLOURS), drawing.experiment.tasks, strict=False):
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
    return _saved(axes.figure, drawing.path(figure.file))


def differences(figure: Differences, drawing: Drawing) -> Path:
    """A Markdown table: task by pair, with interval and verdict."""
    lines = ["| task | pair | seeds | difference | 95 % interval | verdict |", "|---|---|---|---|---|---|"]
    for task in drawing.experiment.tasks:
        for one, other in figure.pairs:
            ends = [drawing.results.last(task, method, figure.measure) for method in (one, other)]
            try:
                found = paired_difference(*ends)
            except ValueError as error:
                lines.append(f"| {task} | {one} − {other} | | | | {error} |")
                continue
            lines.append(
                f"| {task} | {one} − {other} | {len(found.seeds)} | {found.mean:+.1f} |"
                f" {found.low:+.1f} … {found.high:+.1f} | {found.verdict} |"
            )
    path = drawing.path(figure.file, "md")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def frame_strips(figure: Strips, drawing: Drawing) -> Path:
    """A row for each task and method: its best run, from the last video."""
    rows = []
    for task in drawing.experiment.tasks:
        for method in drawing.methods(figure.methods):
            last = drawing.results.last(task, method, "return")
            if last:
                best = max(last, key=lambda seed: last[seed])
                title = f"{preset_named(task).title} · {method}"
                rows.append((title, f"{drawing.experiment.name}-{task}-{method}-{best}"))
    return strips(rows, drawing.data, figure.frames, drawing.path(figure.file))


def queries(figure: Queries, drawing: Drawing) -> Path:
    """What the first seed of each method was asked in some of its sessions."""
    experiment, methods = drawing.experiment, drawing.methods(figure.methods)
    runs = [
        (f"{one.task} · {one.compared.name}", one.run_id)
        for one in experiment.planned()
        if one.seed == experiment.seeds[0] and one.compared.name in methods
    ]
    return query_sheet(runs, drawing.data, figure.sessions, figure.queries, drawing.path(figure.file))


DRAWERS: MappingProxyType[type, Callable[[Any, Drawing], Path]] = MappingProxyType(
    {
        Curves: curves,
        Budgets: budgets,
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
        down, across, figsize=(4.6 * across, 3.6 * down), squeeze=False, layout="constrained"
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
