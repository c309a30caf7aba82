"""Runs: what they are, what is asked of them, what happens to them, and where they go on from."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey
from sqlalchemy.orm import Mapped, mapped_column, relationship

from labels_db.models.base import Base
from labels_db.models.words import Desired, RunState


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
    """A `Phase`, or one that only a newer trainer knows; empty while none owns the run."""
    step: Mapped[int] = mapped_column(default=0)
    steps_per_second: Mapped[float | None]
    wanted_answers: Mapped[int] = mapped_column(default=0)
    next_session_step: Mapped[int | None]
    heartbeat_at: Mapped[datetime | None]
    progress_at: Mapped[datetime | None]

    goal_cards: Mapped[list[GoalCard]] = relationship(order_by="GoalCard.version")

    @property
    def goal(self) -> GoalCard:
        """The latest goal card; a run is asked for with its first."""
        return self.goal_cards[-1]


class ExperimentTitle(Base):
    """What people read where an experiment is meant; runs know it by its name."""

    __tablename__ = "experiment_titles"

    experiment: Mapped[str] = mapped_column(primary_key=True)
    title: Mapped[str]


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
