"""Experiments: methods × tasks × seeds, each a run of its own, and the figures that they are for."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

from pydantic import Field, field_validator, model_validator
from sqlalchemy import select
from sqlalchemy.orm import Session

from labels_db.errors import ConflictError
from labels_db.figures import Differences, Figure, Name
from labels_db.methods import method_named
from labels_db.models import ExperimentTitle, Run, RunState
from labels_db.overrides import with_settings
from labels_db.presets import preset_named
from labels_db.run_config import RunConfig
from labels_db.run_config.base import Config
from labels_db.runs import config_of, id_part, request_run, resume_run, stop_run

WrittenSettings = dict[str, str | int | float | bool]
"""Values by path, as a file of YAML writes them."""


class Compared(Config):
    """A method under a name of its own, with settings of its own, for all tasks and for some."""

    method: str
    name: Name
    settings: WrittenSettings = Field(default_factory=dict)
    by_task: dict[str, WrittenSettings] = Field(default_factory=dict)
    tasks: list[str] | None = None
    """The only tasks it is run on; all where none are named."""

    def runs_on(self, task: str) -> bool:
        return self.tasks is None or task in self.tasks

    @field_validator("method")
    @classmethod
    def _is_known(cls, method: str) -> str:
        return method_named(method).name


class Experiment(Config):
    """What one file says."""

    name: Name
    title: str = Field(min_length=1)
    profile: str | None = None
    tasks: list[str] = Field(min_length=1)
    methods: list[str | Compared] = Field(min_length=1)
    seeds: list[int] = Field(min_length=1)
    settings: WrittenSettings = Field(default_factory=dict)
    by_task: dict[str, WrittenSettings] = Field(default_factory=dict)
    """What all methods set on some tasks; a method's own settings come last."""
    figures: list[Figure] = Field(default_factory=list)

    @field_validator("tasks")
    @classmethod
    def _tasks_are_known(cls, tasks: list[str]) -> list[str]:
        return [preset_named(task).name for task in tasks]

    @model_validator(mode="after")
    def _nothing_is_named_twice(self) -> Experiment:
        """Runs and files are told apart by name."""
        files = [figure.path for figure in self.figures]
        methods = [one.name for one in self.compared]
        for what, names in (
            ("method", methods),
            ("task", self.tasks),
            ("seed", self.seeds),
            ("figure", files),
        ):
            for name, count in Counter(names).items():
                if count > 1:
                    raise ValueError(f"{what} {name!r}: is there {count} times; give each a name of its own")
        return self

    @model_validator(mode="after")
    def _what_is_named_is_run(self) -> Experiment:
        """Figures are about methods and tasks of the experiment, and so are settings."""
        methods, tasks = [one.name for one in self.compared], self.tasks
        for figure in self.figures:
            _known(f"figure {figure.file!r}", "method", figure.shows(), methods)
            _known(f"figure {figure.file!r}", "task", figure.about(), tasks)
        _known("by_task", "task", set(self.by_task), tasks)
        for one in self.compared:
            _known(f"method {one.name!r}", "task", {*one.by_task, *(one.tasks or ())}, tasks)
        return self

    @model_validator(mode="after")
    def _pairs_meet(self) -> Experiment:
        """A difference needs a task on which both methods are run."""
        compared = {one.name: one for one in self.compared}
        for figure in self.figures:
            for one, other in figure.pairs if isinstance(figure, Differences) else ():
                if not any(
                    compared[one].runs_on(task) and compared[other].runs_on(task) for task in self.tasks
                ):
                    raise ValueError(
                        f"figure {figure.file!r}: {one} and {other} are run on no task in common"
                    )
        return self

    @property
    def compared(self) -> list[Compared]:
        """Every method under its name."""
        return [
            one if isinstance(one, Compared) else Compared(method=one, name=method_named(one).name)
            for one in self.methods
        ]

    def planned(self) -> Iterator[PlannedRun]:
        """Every run, seed by seed, so that early results are about everything."""
        for seed, task, one in product(self.seeds, self.tasks, self.compared):
            if one.runs_on(task):
                yield PlannedRun(self, task, one, seed)


DEFAULTS: WrittenSettings = {"evaluation.video": "none", "threads": 1}
"""What experiments set unless they say otherwise: nobody watches, and many runs share the machine."""


@dataclass(frozen=True)
class PlannedRun:
    """One training of an experiment."""

    experiment: Experiment
    task: str
    compared: Compared
    seed: int

    @property
    def run_id(self) -> str:
        return f"{self.experiment.name}-{id_part(self.task)}-{self.compared.name}-{self.seed}"

    @property
    def config(self) -> RunConfig:
        """SettingError names the setting that is wrong."""
        base = method_named(self.compared.method).config(preset_named(self.task), self.experiment.profile)
        own = {**self.compared.settings, **self.compared.by_task.get(self.task, {})}
        shared = {**self.experiment.settings, **self.experiment.by_task.get(self.task, {})}
        chosen = {**DEFAULTS, **shared, **own, "seed": self.seed}
        return with_settings(base, {path: _text(value) for path, value in chosen.items()})


def _known(where: str, what: str, named: set[str], known: Sequence[str]) -> None:
    for name in sorted(named - set(known)):
        raise ValueError(f"{where}: no {what} {name!r}; one of {', '.join(sorted(known))}")


def _text(value: str | float | bool) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def request_experiment(
    session: Session, experiment: Experiment, elsewhere: Collection[str] = frozenset()
) -> list[Run]:
    """Every run of the experiment: finished ones as they are, ended ones asked for again, missing ones queued.

    Those that are done `elsewhere` wait for nothing here any more. ConflictError where a run of that name was
    made with other settings.
    """
    session.merge(ExperimentTitle(experiment=experiment.name, title=experiment.title))
    for run_id in elsewhere:
        run = session.get(Run, run_id)
        if run is not None and run.state is RunState.QUEUED:
            stop_run(session, run_id)
    return [_requested(session, one) for one in experiment.planned() if one.run_id not in elsewhere]


def done_elsewhere(session: Session, joined: Collection[str]) -> set[str]:
    """Of the runs joined from other results those that count as they went there: all that have not finished here."""
    here = select(Run.id).where(Run.id.in_(joined), Run.state == RunState.FINISHED)
    return set(joined) - set(session.scalars(here))


def _requested(session: Session, planned: PlannedRun) -> Run:
    found = session.get(Run, planned.run_id)
    if found is None:
        preset = preset_named(planned.task)
        return request_run(
            session,
            planned.config,
            title=f"{preset.title} · {planned.compared.name}, seed {planned.seed}",
            goal=preset.goal,
            preset=planned.task,
            run_id=planned.run_id,
            experiment=planned.experiment.name,
            method=planned.compared.name,
        )
    if config_of(found) != planned.config:
        raise ConflictError(
            f"run {found.id!r}: is there already, with other settings; give the experiment another name"
        )
    if found.state in {RunState.STOPPED, RunState.FAILED}:
        return resume_run(session, found.id)
    return found


def runs_of_experiment(session: Session, name: str) -> list[Run]:
    """Its runs that are there, by name."""
    return list(session.scalars(select(Run).where(Run.experiment == name).order_by(Run.id)))
