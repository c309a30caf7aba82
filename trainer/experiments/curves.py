"""Learning curves: a measure against steps."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from labels_db.figures import Curves
from labels_db.presets import preset_named
from trainer.experiments.drawing import Drawing
from trainer.experiments.panels import labelled, panels, refuse_nothing, saved
from trainer.experiments.results import Curve
from trainer.experiments.statistics import bootstrap_interval, interquartile_mean


def curves(figure: Curves, drawing: Drawing) -> Path:
    """A panel for each task of which there is something."""
    tasks = drawing.tasks(figure.tasks)
    tasks = [task for task in tasks if drawing.results.has(task)] or tasks
    shown = panels(len(tasks))
    for axes, task in zip(shown, tasks, strict=True):
        for method in _as_curves(figure, drawing):
            _curve(axes, figure, task, method, drawing)
        for method in figure.asymptotes:
            _asymptote(axes, figure, task, method, drawing)
        axes.set(title=preset_named(task).title, xlabel="steps of the agent", ylabel=figure.measure)
        if labelled(axes):
            axes.legend(fontsize=8)
    refuse_nothing(shown, figure.measure)
    return saved(shown[0].figure, drawing.path(figure))


def _as_curves(figure: Curves, drawing: Drawing) -> list[str]:
    """Methods with a line; of one that also has an asymptote it ends where the panel does."""
    return figure.methods or [name for name in drawing.methods(None) if name not in figure.asymptotes]


def _curve(axes: Any, figure: Curves, task: str, method: str, drawing: Drawing) -> None:
    """The method's line, as far as the steps of those that have nothing but a line."""
    if found := drawing.results.comparable(task, method, figure.measure):
        steps, values = aligned(list(found.values()))
        shown = steps <= (_reach(figure, task, drawing) if method in figure.asymptotes else math.inf)
        middle, low, high = (line[shown] for line in SPREADS[figure.statistic](values))
        style = drawing.style(method)
        axes.plot(steps[shown], middle, **style, linewidth=1.6, label=f"{method} ({len(values)})")
        axes.fill_between(steps[shown], low, high, color=style["color"], alpha=0.18, linewidth=0)


def _reach(figure: Curves, task: str, drawing: Drawing) -> float:
    """The last step of the methods that have nothing but a line."""
    lines = [name for name in _as_curves(figure, drawing) if name not in figure.asymptotes]
    found = [drawing.results.comparable(task, name, figure.measure) for name in lines]
    return max((step for curves in found for curve in curves.values() for step, _ in curve), default=math.inf)


def _asymptote(axes: Any, figure: Curves, task: str, method: str, drawing: Drawing) -> None:
    """Where the method's finished runs end, however many steps they had."""
    ends = list(drawing.results.last(task, method, figure.measure).values())
    if ends:
        end = SPREADS[figure.statistic](np.array(ends)[:, None])[0][0]
        style = {**drawing.style(method), "linestyle": ":"}
        axes.axhline(end, **style, linewidth=1.5, label=f"{method} ({len(ends)}), at its end")


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
