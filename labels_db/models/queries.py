"""What is asked: sessions of queries, each a pair of segments with their clips."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import ForeignKey, Index, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column, relationship

from labels_db.models.base import Base
from labels_db.models.words import QueryState


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
