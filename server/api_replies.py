"""What the API gives, described for its OpenAPI document."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from labels_db.models import Choice, Desired, QueryState, RunState


class GoalOut(BaseModel):
    """A goal card."""

    model_config = ConfigDict(from_attributes=True)

    version: int
    text: str
    created_at: datetime


class PresetOut(BaseModel):
    """A named start for a run."""

    name: str
    title: str
    goal: str
    environment: str
    profiles: list[str]


class FieldOut(BaseModel):
    """One setting of a configuration."""

    path: str
    description: str
    value: Any
    type: str
    optional: bool
    primary: bool
    minimum: float | None
    maximum: float | None
    open_minimum: bool
    choices: dict[str, str]


class PresetDetail(PresetOut):
    """A preset with one profile's settings."""

    profile: str
    fields: list[FieldOut]
    bytes: int = Field(description="Estimated bytes on disk at the run's largest.")


class FeedbackOut(BaseModel):
    """How far a run's feedback has come."""

    model_config = ConfigDict(from_attributes=True)

    budget: int = Field(description="Answers wanted in all.")
    given: int = Field(description="Answers given, as the budget counts them.")
    preferences: int = Field(description="Queries that at least one person has preferred or called equal.")
    skipped: int
    open: int = Field(description="Queries that wait for answers.")
    posted: int
    rendering: int = Field(description="Queries asked whose clips are not ready.")


class RunOut(BaseModel):
    """A run as it is now."""

    id: str
    title: str
    preset: str | None
    experiment: str | None = Field(description="The experiment that it belongs to.")
    method: str | None = Field(description="What that experiment calls this run's way of learning.")
    goal: GoalOut
    state: RunState
    desired: Desired
    phase: str
    sentence: str = Field(description="The state in words.", examples=["Waiting for 6 answers."])
    actions: list[str] = Field(description="Which of pause, resume, stop, extend are possible now.")
    step: int
    total_steps: int
    steps_per_second: float | None
    queue_position: int | None
    feedback: FeedbackOut
    last_return: float | None = Field(description="Mean true return of the latest evaluation.")
    attempt: int
    heartbeat_at: datetime | None
    created_at: datetime
    ended_at: datetime | None
    error: str | None


class Series(BaseModel):
    """One metric: values at steps."""

    steps: list[int]
    values: list[float | None]


class MetricsOut(BaseModel):
    """The metrics asked for; when `attempt` has changed, ask for all of them again."""

    attempt: int
    step: int
    series: dict[str, Series]


class EvaluationOut(BaseModel):
    """How the policy did at one step."""

    step: int
    returns: list[float]
    mean_return: float
    measures: dict[str, Any]
    video_url: str | None
    at: datetime


class FitOut(BaseModel):
    """One learning of the reward model."""

    model_config = ConfigDict(from_attributes=True)

    index: int
    step: int
    cursor: int = Field(description="Sequence of the last answer it knew.")
    preferences: int
    epochs: int
    training_accuracy: float | None
    fresh_accuracy: float | None
    at: datetime


class QueryOut(BaseModel):
    """A pair asked."""

    model_config = ConfigDict(from_attributes=True)

    id: int
    session_id: int
    index: int
    state: QueryState
    closed_reason: str | None
    scheme: str
    answers_needed: int
    first_id: int = Field(description="Segment id; its clip is at /artifacts/clips/{id}.")
    second_id: int
    posted_at: datetime


class AnswerOut(BaseModel):
    """What one labeller chose."""

    sequence: int
    query_id: int
    labeller: str
    choice: Choice
    taken_back: bool
    probability: float | None = Field(description="P[second ≻ first] under the latest fit.")
    goal_version: int | None
    answered_at: datetime


class EventOut(BaseModel):
    """Something that happened to a run."""

    model_config = ConfigDict(from_attributes=True)

    at: datetime
    attempt: int
    text: str


class LogOut(BaseModel):
    """The end of a run's log."""

    lines: list[str]


class CommandOut(BaseModel):
    """Something asked of a run's last policy, and what came of it."""

    id: int
    kind: str
    arguments: dict[str, Any]
    asked_at: datetime
    taken_at: datetime | None
    done_at: datetime | None
    sentence: str = Field(description="How it stands, in words.", examples=["Waiting for the supervisor."])
    result: dict[str, Any] | None = Field(
        description="What came of it; absent while it waits or when it failed."
    )
    error: str | None = Field(description="Why nothing came of it.")
    download_url: str | None = Field(description="Where the exported policy is.")
