"""An experiment as pages show it: how far its runs have come, and its results as a table of tasks and methods."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import product

from labels_db.errors import ChoiceError
from labels_db.experiment_overview import ExperimentOverview, ExperimentSummary, Result, RunTally
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
        return not (self.summary.tally.going or self.summary.tally.queued)

    @property
    def size(self) -> str:
        """Its name and how much of what: few-labels: 2 tasks, 3 methods."""
        tasks, methods = len(self.summary.tasks), len(self.summary.methods)
        return f"{self.summary.name}: {plural(tasks, 'task')}, {plural(methods, 'method')}"


def experiment_view(summary: ExperimentSummary) -> ExperimentView:
    return ExperimentView(summary, tally_sentence(summary.tally), _tone(summary.tally))


def tally_sentence(tally: RunTally) -> str:
    """How many runs are where; what there is none of is not mentioned."""
    if tally.finished == tally.runs:
        return "Its one run has finished." if tally.runs == 1 else f"All {number(tally.runs)} runs finished."
    others = {
        "under way": tally.going,
        "queued": tally.queued,
        "failed": tally.failed,
        "stopped": tally.stopped,
    }
    told = [f"{number(count)} {word}" for word, count in others.items() if count]
    return f"{number(tally.finished)} of {plural(tally.runs, 'run')} finished, {', '.join(told)}."


def _tone(tally: RunTally) -> Tone:
    """What goes on counts before what went wrong: the sentence tells both."""
    tones: Mapping[Tone, int] = {
        "going": tally.going,
        "resting": tally.queued,
        "wrong": tally.failed,
    }
    rest: Tone = "resting" if tally.stopped else "done"
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
