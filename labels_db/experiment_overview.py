"""An experiment as a whole: how many of its runs have come how far, and what its methods reached on its tasks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import product
from statistics import fmean
from typing import Any

from sqlalchemy import Row, func, select
from sqlalchemy.orm import Session

from labels_db.errors import NotFoundError
from labels_db.evaluation_curves import (
    Spread,
    evaluated_at,
    last_evaluations,
    measures_in,
    spread_of,
    value_of,
)
from labels_db.models import ALIVE, EvaluationResult, ExperimentTitle, Run, RunState
from labels_db.overview import RunOverview, experiment_overviews


@dataclass(frozen=True)
class RunTally:
    """How many runs have come how far."""

    finished: int
    going: int
    queued: int
    failed: int
    stopped: int

    @property
    def runs(self) -> int:
        return self.finished + self.going + self.queued + self.failed + self.stopped


def tally_of(states: Sequence[tuple[RunState, int]]) -> RunTally:
    """From counts of states."""
    return RunTally(
        finished=_sum(states, RunState.FINISHED),
        going=_sum(states, *ALIVE),
        queued=_sum(states, RunState.QUEUED),
        failed=_sum(states, RunState.FAILED),
        stopped=_sum(states, RunState.STOPPED),
    )


def _sum(states: Sequence[tuple[RunState, int]], *counted: RunState) -> int:
    return sum(count for state, count in states if state in counted)


@dataclass(frozen=True)
class ExperimentSummary:
    """What the dashboard says of an experiment; tasks and methods in the order of its file."""

    name: str
    title: str
    created_at: datetime
    tasks: Sequence[str]
    methods: Sequence[str]
    tally: RunTally


def experiments(session: Session) -> list[ExperimentSummary]:
    """Every experiment that has runs, the newest first."""
    first = func.min(Run.created_at)
    rows = session.execute(
        select(Run.experiment, Run.preset, Run.method, Run.state, func.count(), first)
        .where(Run.experiment.is_not(None), ~Run.archived)
        .group_by(Run.experiment, Run.preset, Run.method, Run.state)
        .order_by(first)
    ).all()
    titles = {kept.experiment: kept.title for kept in session.scalars(select(ExperimentTitle))}
    names = dict.fromkeys(name for name, *_ in rows if name)
    found = [
        _summary(name, titles.get(name, name), [row for row in rows if row[0] == name]) for name in names
    ]
    return sorted(found, key=lambda each: each.created_at, reverse=True)


def experiment_title(session: Session, name: str) -> str:
    """What its file calls it; its name where that was not kept."""
    kept = session.get(ExperimentTitle, name)
    return kept.title if kept else name


def _summary(
    name: str, title: str, rows: Sequence[Row[Any, Any, Any, RunState, int, datetime]]
) -> ExperimentSummary:
    return ExperimentSummary(
        name=name,
        title=title,
        created_at=rows[0][5],
        tasks=list(dict.fromkeys(row[1] or "" for row in rows)),
        methods=list(dict.fromkeys(row[2] or "" for row in rows)),
        tally=tally_of([(row[3], row[4]) for row in rows]),
    )


@dataclass(frozen=True)
class ExperimentOverview:
    """An experiment with its runs, in the order of its file, and their last evaluations."""

    summary: ExperimentSummary
    runs: Sequence[RunOverview]
    last: Mapping[str, EvaluationResult]

    @property
    def measures(self) -> list[str]:
        return measures_in(self.last.values())

    @property
    def evaluated_at(self) -> str:
        return evaluated_at(self.last.values())

    def last_value(self, run_id: str, measure: str) -> float | None:
        """At the run's last evaluation."""
        found = self.last.get(run_id)
        return value_of(found, measure) if found else None

    def runs_of(self, task: str, method: str) -> list[RunOverview]:
        """One for each seed."""
        return [seen for seen in self.runs if (seen.run.preset, seen.run.method) == (task, method)]

    def counted(self, task: str, method: str) -> list[RunOverview]:
        """What a mean is over: the seeds that have finished, since one under way would drag it down; or all."""
        runs = self.runs_of(task, method)
        return [seen for seen in runs if seen.run.state is RunState.FINISHED] or runs

    def results(self, measure: str) -> list[Result]:
        """Of every method on every task that it was asked to learn, task by task."""
        summary = self.summary
        planned = (
            (task, method, self.runs_of(task, method))
            for task, method in product(summary.tasks, summary.methods)
        )
        return [self._result(task, method, runs, measure) for task, method, runs in planned if runs]

    def _result(self, task: str, method: str, runs: Sequence[RunOverview], measure: str) -> Result:
        counted = self.counted(task, method)
        values = [self.last_value(seen.run.id, measure) for seen in counted]
        given = [seen.feedback.given for seen in counted if seen.run.id in self.last]
        return Result(
            task=task,
            method=method,
            tally=tally_of([(seen.run.state, 1) for seen in runs]),
            last=spread_of([value for value in values if value is not None]),
            answers=fmean(given) if given else None,
        )


@dataclass(frozen=True)
class Result:
    """What one method reached on one task, over its seeds.

    `last` is of the last evaluation of every run that is counted, `answers` how many those were given on average.
    """

    task: str
    method: str
    tally: RunTally
    last: Spread | None
    answers: float | None


def experiment_overview(session: Session, name: str) -> ExperimentOverview:
    """The experiment of that name; NotFoundError when no run belongs to it."""
    runs = experiment_overviews(session, name)
    if not runs:
        raise NotFoundError(
            f"experiment {name!r}: has no runs in this database; the dashboard lists those that have",
            field="name",
        )
    summary = ExperimentSummary(
        name=name,
        title=experiment_title(session, name),
        created_at=runs[0].run.created_at,
        tasks=list(dict.fromkeys(seen.run.preset or "" for seen in runs)),
        methods=list(dict.fromkeys(seen.run.method or "" for seen in runs)),
        tally=tally_of([(seen.run.state, 1) for seen in runs]),
    )
    return ExperimentOverview(summary, runs, last_evaluations(session, [seen.run.id for seen in runs]))
