"""An experiment as pages show it: its standing in words, and its results as a table of tasks and methods."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import product

from labels_db.errors import ChoiceError
from labels_db.experiment_overview import ExperimentOverview, ExperimentSummary, Result, Standing
from labels_db.numbers import number
from labels_db.presets import preset_named
from server.run_view import RunView, Tone, view
from server.words import plural


@dataclass(frozen=True)
class ExperimentView:
    """What the dashboard's row and the experiment's header say."""

    summary: ExperimentSummary
    sentence: str
    tone: Tone

    @property
    def over(self) -> bool:
        return not (self.summary.standing.going or self.summary.standing.queued)

    @property
    def size(self) -> str:
        """Its name and how much of what: few-labels: 2 tasks, 3 methods."""
        tasks, methods = len(self.summary.tasks), len(self.summary.methods)
        return f"{self.summary.name}: {plural(tasks, 'task')}, {plural(methods, 'method')}"


def experiment_view(summary: ExperimentSummary) -> ExperimentView:
    return ExperimentView(summary, standing_sentence(summary.standing), _tone(summary.standing))


def standing_sentence(standing: Standing) -> str:
    """How many runs are where; what there is none of is not mentioned."""
    if standing.finished == standing.runs:
        return (
            "Its one run has finished."
            if standing.runs == 1
            else f"All {number(standing.runs)} runs finished."
        )
    others = {
        "under way": standing.going,
        "queued": standing.queued,
        "failed": standing.failed,
        "stopped": standing.stopped,
    }
    told = [f"{number(count)} {word}" for word, count in others.items() if count]
    return f"{number(standing.finished)} of {plural(standing.runs, 'run')} finished, {', '.join(told)}."


def _tone(standing: Standing) -> Tone:
    """What goes on counts before what went wrong: the sentence tells both."""
    tones: Mapping[Tone, int] = {
        "going": standing.going,
        "resting": standing.queued,
        "wrong": standing.failed,
    }
    rest: Tone = "resting" if standing.stopped else "done"
    return next((tone for tone, count in tones.items() if count), rest)


@dataclass(frozen=True)
class Task:
    """A row of the results: one task and what each method, in the columns' order, reached on it."""

    name: str
    results: Sequence[Result | None]

    @property
    def title(self) -> str:
        return task_title(self.name)


def tasks_of(shown: ExperimentOverview, measure: str) -> list[Task]:
    found = {(result.task, result.method): result for result in shown.results(measure)}
    return [
        Task(task, [found.get((task, method)) for method in shown.summary.methods])
        for task in shown.summary.tasks
    ]


def task_title(name: str) -> str:
    """What the task is called; an extension's may be gone."""
    try:
        return preset_named(name).title
    except ValueError:
        return name


@dataclass(frozen=True)
class ExperimentRun:
    """A line of the list of runs."""

    shown: RunView
    value: float | None


def runs_of(shown: ExperimentOverview, measure: str, now: datetime) -> list[ExperimentRun]:
    """Task by task and method by method, as in the table of results."""
    pairs = product(shown.summary.tasks, shown.summary.methods)
    runs = [seen for task, method in pairs for seen in shown.runs_of(task, method)]
    return [ExperimentRun(view(seen, now), shown.last_value(seen.run.id, measure)) for seen in runs]


def known_measure(measure: str, measures: Sequence[str]) -> str:
    """The measure asked for; ChoiceError names the ones there are."""
    if measure not in measures:
        raise ChoiceError(f"measure {measure!r}: not measured here; one of {', '.join(measures)}")
    return measure
