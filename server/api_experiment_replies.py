"""What the API gives of experiments, described for its OpenAPI document."""

from __future__ import annotations

from datetime import datetime

from pydantic import BaseModel, ConfigDict, Field

from labels_db.models import RunState
from server.api_replies import Series


class TallyOut(BaseModel):
    """How many runs have come how far."""

    model_config = ConfigDict(from_attributes=True)

    runs: int = Field(description="All of them.")
    finished: int
    going: int = Field(description="Under way: starting, running, waiting or paused.")
    queued: int
    failed: int
    stopped: int


class TaskOut(BaseModel):
    """What methods were compared on: a preset."""

    name: str
    title: str


class ExperimentOut(BaseModel):
    """Methods, tasks and seeds, each combination a run of its own."""

    name: str = Field(description="What its runs' names begin with.")
    title: str = Field(description="What its file calls it.")
    created_at: datetime
    tasks: list[TaskOut]
    methods: list[str]
    tally: TallyOut


class MeanCurve(BaseModel):
    """Mean and standard deviation over seeds, at the steps that all evaluated ones share."""

    steps: list[int]
    means: list[float]
    deviations: list[float]


class ResultOut(BaseModel):
    """What one method reached on one task, over its seeds."""

    task: str
    method: str
    tally: TallyOut
    evaluated: int = Field(description="Runs of which the mean is.")
    mean: float | None = Field(description="Of the last evaluations.")
    deviation: float | None = Field(description="Their standard deviation.")
    answers: float | None = Field(description="Answers given to each of the evaluated runs, on average.")
    curve: MeanCurve


class ExperimentRunOut(BaseModel):
    """A run of an experiment, with its own curve."""

    id: str
    task: str
    method: str
    seed: int
    state: RunState
    step: int
    total_steps: int
    answers: int
    curve: Series


class ExperimentDetail(ExperimentOut):
    """An experiment with what it came to by one measure, task by task and run by run."""

    measures: list[str] = Field(description="What its evaluations have measured.")
    measure: str = Field(description="The one that means and curves are of.")
    results: list[ResultOut]
    runs: list[ExperimentRunOut]
