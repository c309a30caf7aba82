"""Experiments: methods × tasks × seeds, each a run of its own, and the figures that they are for."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator
from sqlalchemy import select
from sqlalchemy.orm import Session

from labels_db.errors import ConflictError
from labels_db.methods import method_named
from labels_db.models import Run, RunState
from labels_db.overrides import with_settings
from labels_db.presets import preset_named
from labels_db.run_config import RunConfig
from labels_db.run_config.base import Config
from labels_db.runs import request_run, resume_run

Settings = dict[str, str | int | float | bool]
Name = Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9-]*$", max_length=60)]
"""Lower case, digits and hyphens: it becomes part of a run's name and of a file's."""


class Compared(Config):
    """A method under a name of its own, with settings of its own, for all tasks and for some."""

    method: str
    name: Name
    settings: Settings = Field(default_factory=dict)
    by_task: dict[str, Settings] = Field(default_factory=dict)
    tasks: list[str] | None = None
    """The only tasks it is run on; all where none are named."""

    @field_validator("method")
    @classmethod
    def _is_known(cls, method: str) -> str:
        return method_named(method).name


class OfMethods(Config):
    """A figure about some methods, or all."""

    file: Name
    methods: list[str] | None = None

    def about(self) -> set[str]:
        """The tasks that it names."""
        return set()

    def shows(self) -> set[str]:
        """The methods that it names."""
        return set(self.methods or ())


class Curves(OfMethods):
    """A measure against steps: a panel for each task, a line for each method."""

    kind: Literal["curves"] = "curves"
    measure: str = "return"
    tasks: list[str] | None = None
    asymptotes: list[str] = Field(default_factory=list)
    """Methods of which only the last value is drawn, as a dotted line."""
    statistic: Literal["mean", "iqm"] = "mean"
    """Mean and standard deviation, or interquartile mean and its 95 % bootstrap interval."""

    def about(self) -> set[str]:
        return set(self.tasks or ())

    def shows(self) -> set[str]:
        return super().shows() | set(self.asymptotes)


class Budgets(OfMethods):
    """The last value against the number of labels, a line for each task."""

    kind: Literal["budgets"] = "budgets"
    measure: str = "return"


class Differences(Config):
    """A table: by how much one method ends above another, seed by seed."""

    kind: Literal["differences"] = "differences"
    file: Name
    measure: str = "return"
    pairs: list[tuple[str, str]]

    def about(self) -> set[str]:
        """The tasks that it names."""
        return set()

    def shows(self) -> set[str]:
        """The methods that it names."""
        return {method for pair in self.pairs for method in pair}


class Strips(OfMethods):
    """Frames of what was learned, by each method's best run."""

    kind: Literal["strips"] = "strips"
    frames: int = Field(8, ge=2, le=24)


class Queries(OfMethods):
    """Sheets of queries as they were asked: first and second segment, side by side."""

    kind: Literal["queries"] = "queries"
    sessions: list[int] = Field(default_factory=lambda: [0, 1, 3])
    queries: int = Field(4, ge=1, le=20)


Figure = Annotated[Curves | Budgets | Differences | Strips | Queries, Field(discriminator="kind")]


class Experiment(Config):
    """What one file says."""

    name: Name
    title: str
    profile: str | None = None
    tasks: list[str] = Field(min_length=1)
    methods: list[str | Compared] = Field(min_length=1)
    seeds: list[int] = Field(min_length=1)
    settings: Settings = Field(default_factory=dict)
    figures: list[Figure] = Field(default_factory=list)

    @field_validator("tasks")
    @classmethod
    def _tasks_are_known(cls, tasks: list[str]) -> list[str]:
        return [preset_named(task).name for task in tasks]

    @model_validator(mode="after")
    def _nothing_is_named_twice(self) -> Experiment:
        """Runs and files are told apart by name."""
        files = [f"{figure.file} ({figure.kind})" for figure in self.figures]
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
        for one in self.compared:
            _known(f"method {one.name!r}", "task", {*one.by_task, *(one.tasks or ())}, tasks)
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
            if task in (one.tasks or self.tasks):
                yield PlannedRun(self, task, one, seed)


DEFAULTS: Settings = {"evaluation.video": "none", "threads": 1}
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
        return f"{self.experiment.name}-{self.task}-{self.compared.name}-{self.seed}"

    @property
    def config(self) -> RunConfig:
        """SettingError names the setting that is wrong."""
        base = method_named(self.compared.method).config(preset_named(self.task), self.experiment.profile)
        own = {**self.compared.settings, **self.compared.by_task.get(self.task, {})}
        chosen = {**DEFAULTS, **self.experiment.settings, **own, "seed": self.seed}
        return with_settings(base, {path: _text(value) for path, value in chosen.items()})


def _known(where: str, what: str, named: set[str], known: Sequence[str]) -> None:
    for name in sorted(named - set(known)):
        raise ValueError(f"{where}: no {what} {name!r}; one of {', '.join(sorted(known))}")


def _text(value: str | float | bool) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def request_experiment(session: Session, experiment: Experiment) -> list[Run]:
    """Every run of the experiment: finished ones as they are, ended ones asked for again, missing ones queued.

    ConflictError where a run of that name was made with other settings.
    """
    return [_requested(session, planned) for planned in experiment.planned()]


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
    if RunConfig.model_validate(found.config) != planned.config:
        raise ConflictError(
            f"run {found.id!r}: is there already, with other settings; give the experiment another name"
        )
    if found.state in {RunState.STOPPED, RunState.FAILED}:
        return resume_run(session, found.id)
    return found


def runs_of_experiment(session: Session, name: str) -> list[Run]:
    """Its runs that are there, by name."""
    return list(session.scalars(select(Run).where(Run.experiment == name).order_by(Run.id)))
