"""The figures that an experiment may ask for."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from labels_db.run_config.base import Config

Name = Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9-]*$", max_length=60)]
"""Lower case, digits and hyphens: it becomes part of a run's name and of a file's."""


class OfFile(Config):
    """A figure in a file of its own."""

    file: Name
    ending: ClassVar[str] = "png"
    of_runs: ClassVar[bool] = False
    """Whether it is drawn from the runs themselves; results alone are enough for the others."""

    @property
    def path(self) -> str:
        """The file it is written to."""
        return f"{self.file}.{self.ending}"


class OfMethods(OfFile):
    """A figure about some methods and tasks, or all."""

    methods: list[str] | None = None
    tasks: list[str] | None = None

    def about(self) -> set[str]:
        """The tasks that it names."""
        return set(self.tasks or ())

    def shows(self) -> set[str]:
        """The methods that it names."""
        return set(self.methods or ())


class Curves(OfMethods):
    """A measure against steps: a panel for each task, a line for each method."""

    kind: Literal["curves"] = "curves"
    measure: str = "return"
    asymptotes: list[str] = Field(default_factory=list)
    """Methods whose last value is drawn as a dotted line; their curves too only where `methods` names them."""
    statistic: Literal["mean", "iqm"] = "mean"
    """Mean and standard deviation, or interquartile mean and its 95 % bootstrap interval."""

    def shows(self) -> set[str]:
        return super().shows() | set(self.asymptotes)


class Budgets(OfMethods):
    """The last value against the number of labels, a line for each task."""

    kind: Literal["budgets"] = "budgets"
    measure: str = "return"


class Ends(OfMethods):
    """A table: where each method's seeds end, after how many steps and answers."""

    ending = "md"
    kind: Literal["ends"] = "ends"
    measure: str = "return"
    published: dict[str, float] = Field(default_factory=dict)
    """What others have published for a task, to be shown as a share."""

    def about(self) -> set[str]:
        return super().about() | set(self.published)


class Differences(OfFile):
    """A table: by how much one method ends above another, or above a share of it, seed by seed."""

    ending = "md"
    kind: Literal["differences"] = "differences"
    measure: str = "return"
    pairs: list[tuple[str, str]]
    share: float = Field(1.0, gt=0, le=1)
    """Of the other method: with 0.95, "higher" means at least 95 % of it, where the measure is not negative."""

    def about(self) -> set[str]:
        """The tasks that it names."""
        return set()

    def shows(self) -> set[str]:
        """The methods that it names."""
        return {method for pair in self.pairs for method in pair}


class Strips(OfMethods):
    """Frames of what was learned, by each method's best run in its best episode."""

    of_runs = True
    kind: Literal["strips"] = "strips"
    measure: str = "return"
    """What rows are told apart by, and what says which run and episode are best."""
    best_by: dict[str, str] = Field(default_factory=dict)
    """Tasks whose best is told by another measure."""
    frames: int = Field(8, ge=2, le=24)

    def about(self) -> set[str]:
        return super().about() | set(self.best_by)


class Queries(OfMethods):
    """Sheets of queries as they were asked: first and second segment, side by side."""

    of_runs = True
    kind: Literal["queries"] = "queries"
    sessions: list[int] = Field(default_factory=lambda: [0, 1, 3])
    queries: int = Field(4, ge=1, le=20)


Figure = Annotated[Curves | Budgets | Ends | Differences | Strips | Queries, Field(discriminator="kind")]
