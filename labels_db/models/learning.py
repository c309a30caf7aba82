"""What training says of itself: fits, scores, metrics, evaluations."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from labels_db.models.base import Base


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
