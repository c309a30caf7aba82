"""The tables. What each row means, and who writes it, is in `docs/architecture.md`."""

from __future__ import annotations

from datetime import UTC, datetime
from enum import StrEnum
from typing import Any, ClassVar

from sqlalchemy import (
    JSON,
    DateTime,
    Dialect,
    Enum,
    ForeignKey,
    Index,
    MetaData,
    TypeDecorator,
    UniqueConstraint,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column, relationship


class RunState(StrEnum):
    """Where a run is; `docs/architecture.md` draws the arrows."""

    QUEUED = "queued"
    STARTING = "starting"
    RUNNING = "running"
    WAITING = "waiting"
    PAUSED = "paused"
    FINISHED = "finished"
    FAILED = "failed"
    STOPPED = "stopped"
    INTERRUPTED = "interrupted"


ALIVE = (RunState.STARTING, RunState.RUNNING, RunState.WAITING, RunState.PAUSED)
"""States in which an attempt owns the run."""

ENDED = (RunState.FINISHED, RunState.FAILED, RunState.STOPPED)
"""States that the run leaves only when somebody asks for it."""


class Desired(StrEnum):
    """What people want of a run; its trainer obeys."""

    RUN = "run"
    PAUSE = "pause"
    STOP = "stop"


class QueryState(StrEnum):
    OPEN = "open"
    CLOSED = "closed"
    FAILED = "failed"


class Choice(StrEnum):
    """An answer in the query's own order, whatever side each segment was shown on."""

    FIRST = "first"
    SECOND = "second"
    EQUAL = "equal"
    SKIP = "skip"


class Pressed(StrEnum):
    """An answer as the labeller gave it: a side of the page, or a key for both."""

    LEFT = "left"
    RIGHT = "right"
    EQUAL = "equal"
    SKIP = "skip"


class LabellerKind(StrEnum):
    PERSON = "person"
    SCRIPTED = "scripted"


class Moment(TypeDecorator[datetime]):
    """A time with its zone: SQLite keeps none, so UTC goes in and UTC comes out."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        if value is not None and value.tzinfo is None:
            raise ValueError(f"time {value}: has no zone; use utc_now()")
        return value.astimezone(UTC) if value else None

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        return value.replace(tzinfo=UTC) if value and value.tzinfo is None else value


def utc_now() -> datetime:
    return datetime.now(UTC)


def _words(kind: type[StrEnum]) -> Enum:
    return Enum(kind, native_enum=False, length=16, values_callable=lambda k: [member.value for member in k])


class Base(DeclarativeBase):
    # Named constraints, so that later migrations can address them.
    metadata = MetaData(
        naming_convention={
            "ix": "ix_%(column_0_label)s",
            "uq": "uq_%(table_name)s_%(column_0_name)s",
            "ck": "ck_%(table_name)s_%(constraint_name)s",
            "fk": "fk_%(table_name)s_%(column_0_name)s",
            "pk": "pk_%(table_name)s",
        }
    )
    type_annotation_map: ClassVar[dict[Any, Any]] = {
        dict[str, Any]: JSON,
        list[float]: JSON,
        datetime: Moment,
        RunState: _words(RunState),
        Desired: _words(Desired),
        QueryState: _words(QueryState),
        Choice: _words(Choice),
        Pressed: _words(Pressed),
        LabellerKind: _words(LabellerKind),
    }


class Run(Base):
    """One training: what it is, what is wanted of it, and how far its trainer says it has come."""

    __tablename__ = "runs"

    id: Mapped[str] = mapped_column(primary_key=True)
    title: Mapped[str]
    preset: Mapped[str | None]
    experiment: Mapped[str | None] = mapped_column(index=True)
    method: Mapped[str | None]
    """What an experiment calls this run's way of learning."""
    config: Mapped[dict[str, Any]]
    state: Mapped[RunState] = mapped_column(default=RunState.QUEUED, index=True)
    desired: Mapped[Desired] = mapped_column(default=Desired.RUN)
    owner: Mapped[str | None]
    attempt: Mapped[int] = mapped_column(default=0)
    fruitless_attempts: Mapped[int] = mapped_column(default=0)
    answer_sequence: Mapped[int] = mapped_column(default=0)
    error: Mapped[str | None]
    archived: Mapped[bool] = mapped_column(default=False)
    queued_at: Mapped[datetime]
    created_at: Mapped[datetime]
    ended_at: Mapped[datetime | None]

    # What the trainer last said of itself.
    phase: Mapped[str] = mapped_column(default="")
    step: Mapped[int] = mapped_column(default=0)
    steps_per_second: Mapped[float | None]
    wanted_answers: Mapped[int] = mapped_column(default=0)
    next_session_step: Mapped[int | None]
    heartbeat_at: Mapped[datetime | None]
    progress_at: Mapped[datetime | None]

    goal_cards: Mapped[list[GoalCard]] = relationship(order_by="GoalCard.version")


class GoalCard(Base):
    """What labellers are asked to look for; a change is a new version."""

    __tablename__ = "goal_cards"

    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id"), primary_key=True)
    version: Mapped[int] = mapped_column(primary_key=True)
    text: Mapped[str]
    created_at: Mapped[datetime]


class Command(Base):
    """Something asked of a run once, done by its trainer or, when that has ended, by the supervisor."""

    __tablename__ = "commands"

    id: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id"), index=True)
    kind: Mapped[str]
    arguments: Mapped[dict[str, Any]]
    asked_by: Mapped[str]
    asked_at: Mapped[datetime]
    taken_by_attempt: Mapped[int | None]
    taken_at: Mapped[datetime | None]
    done_at: Mapped[datetime | None]
    result: Mapped[dict[str, Any] | None]


class FeedbackSession(Base):
    """M queries asked at one step of a run."""

    __tablename__ = "feedback_sessions"
    __table_args__ = (UniqueConstraint("run_id", "index"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id"))
    index: Mapped[int]
    step: Mapped[int]
    asked: Mapped[int]
    opened_at: Mapped[datetime]
    closed_at: Mapped[datetime | None]
    segment_return: Mapped[float | None]
    """What a segment earned on average in the last episodes before it; scripted teachers judge by it."""


class Segment(Base):
    """H steps of one episode; the artifact holds the arrays and the simulator's states."""

    __tablename__ = "segments"

    id: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id"), index=True)
    episode: Mapped[int]
    start: Mapped[int]
    length: Mapped[int]
    policy_step: Mapped[int]
    artifact_key: Mapped[str]
    checksum: Mapped[str]
    true_return: Mapped[float | None]

    clip: Mapped[Clip | None] = relationship(back_populates="segment")


class Clip(Base):
    """A segment rendered: a sprite sheet of frames in a grid, and when each is shown."""

    __tablename__ = "clips"

    segment_id: Mapped[int] = mapped_column(ForeignKey("segments.id"), primary_key=True)
    artifact_key: Mapped[str]
    checksum: Mapped[str]
    frames: Mapped[int]
    rows: Mapped[int]
    columns: Mapped[int]
    width: Mapped[int]
    height: Mapped[int]
    duration: Mapped[float]
    times: Mapped[list[float]]

    segment: Mapped[Segment] = relationship(back_populates="clip")


class Query(Base):
    """A pair of segments asked. Leased and answered are derived from leases and answers."""

    __tablename__ = "queries"
    __table_args__ = (
        UniqueConstraint("session_id", "index"),
        Index("ix_queries_run_state", "run_id", "state"),
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id"))
    session_id: Mapped[int] = mapped_column(ForeignKey("feedback_sessions.id"))
    index: Mapped[int]
    first_id: Mapped[int] = mapped_column(ForeignKey("segments.id"))
    second_id: Mapped[int] = mapped_column(ForeignKey("segments.id"))
    scheme: Mapped[str]
    score: Mapped[float | None]
    answers_needed: Mapped[int] = mapped_column(default=1)
    repeat_of: Mapped[int | None] = mapped_column(ForeignKey("queries.id"))
    state: Mapped[QueryState] = mapped_column(default=QueryState.OPEN)
    closed_reason: Mapped[str | None]
    posted_at: Mapped[datetime]
    closed_at: Mapped[datetime | None]

    first: Mapped[Segment] = relationship(foreign_keys=[first_id])
    second: Mapped[Segment] = relationship(foreign_keys=[second_id])
    session: Mapped[FeedbackSession] = relationship()


class Labeller(Base):
    """Somebody, or some script, that answers."""

    __tablename__ = "labellers"
    __table_args__ = (UniqueConstraint("kind", "name"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str]
    kind: Mapped[LabellerKind] = mapped_column(default=LabellerKind.PERSON)
    created_at: Mapped[datetime]


class Invite(Base):
    """A link with which a labeller joins one run without the operator's token."""

    __tablename__ = "invites"

    id: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id"), index=True)
    token_hash: Mapped[str] = mapped_column(unique=True)
    labeller_id: Mapped[int | None] = mapped_column(ForeignKey("labellers.id"))
    created_at: Mapped[datetime]
    expires_at: Mapped[datetime]
    revoked_at: Mapped[datetime | None]


class Lease(Base):
    """A query lent to one labeller for a while, and which side its first segment is shown on."""

    __tablename__ = "leases"
    __table_args__ = (Index("ix_leases_query_expiry", "query_id", "expires_at"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    query_id: Mapped[int] = mapped_column(ForeignKey("queries.id"))
    labeller_id: Mapped[int] = mapped_column(ForeignKey("labellers.id"), index=True)
    swapped: Mapped[bool]
    granted_at: Mapped[datetime]
    expires_at: Mapped[datetime]

    query: Mapped[Query] = relationship()
    answer: Mapped[Answer | None] = relationship(back_populates="lease")


class Answer(Base):
    """What one labeller chose, or the retraction of it. Rows are added, never changed."""

    __tablename__ = "answers"
    __table_args__ = (UniqueConstraint("run_id", "sequence"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id"))
    query_id: Mapped[int] = mapped_column(ForeignKey("queries.id"), index=True)
    labeller_id: Mapped[int] = mapped_column(ForeignKey("labellers.id"))
    sequence: Mapped[int]
    answer_id: Mapped[str] = mapped_column(unique=True)
    lease_id: Mapped[int | None] = mapped_column(ForeignKey("leases.id"), unique=True)
    choice: Mapped[Choice | None]
    pressed: Mapped[Pressed | None]
    retracts: Mapped[int | None] = mapped_column(ForeignKey("answers.id"), unique=True)
    goal_card_version: Mapped[int | None]
    shown_at: Mapped[datetime | None]
    answered_at: Mapped[datetime]

    lease: Mapped[Lease | None] = relationship(back_populates="answer")
    query: Mapped[Query] = relationship()
    labeller: Mapped[Labeller] = relationship()


class Fit(Base):
    """One learning of the reward model, with the last answer it knew."""

    __tablename__ = "fits"
    __table_args__ = (UniqueConstraint("run_id", "index"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id"))
    index: Mapped[int]
    step: Mapped[int]
    cursor: Mapped[int]
    preferences: Mapped[int]
    epochs: Mapped[int]
    training_accuracy: Mapped[float | None]
    fresh_accuracy: Mapped[float | None]
    at: Mapped[datetime]


class QueryScore(Base):
    """P[second ≻ first] of one query under the ensemble after one fit, so that pages need no model."""

    __tablename__ = "query_scores"

    fit_id: Mapped[int] = mapped_column(ForeignKey("fits.id", ondelete="CASCADE"), primary_key=True)
    query_id: Mapped[int] = mapped_column(ForeignKey("queries.id"), primary_key=True)
    probability: Mapped[float]


class Metric(Base):
    """One number of a run at one step."""

    __tablename__ = "metrics"

    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id"), primary_key=True)
    name: Mapped[str] = mapped_column(primary_key=True)
    step: Mapped[int] = mapped_column(primary_key=True)
    value: Mapped[float]


class EvaluationResult(Base):
    """How the policy did at one step: true returns, the behaviour's own measures, one episode as video."""

    __tablename__ = "evaluations"
    __table_args__ = (UniqueConstraint("run_id", "step"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id"))
    step: Mapped[int]
    returns: Mapped[list[float]]
    mean_return: Mapped[float]
    measures: Mapped[dict[str, Any]]
    video_key: Mapped[str | None]
    at: Mapped[datetime]


class Checkpoint(Base):
    """A manifest from which the run can go on exactly."""

    __tablename__ = "checkpoints"

    id: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id"), index=True)
    attempt: Mapped[int]
    step: Mapped[int]
    manifest_key: Mapped[str]
    checksum: Mapped[str]
    at: Mapped[datetime]


class Event(Base):
    """Something that happened to a run, in a sentence for people."""

    __tablename__ = "events"

    id: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id"), index=True)
    attempt: Mapped[int]
    at: Mapped[datetime]
    text: Mapped[str]
