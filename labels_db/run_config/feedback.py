"""When and how much is asked."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from labels_db.run_config.base import Config, primary
from labels_db.run_config.schemes import Entropy, SchemeConfig
from labels_db.run_config.teachers import Oracle, TeacherConfig


class NoFeedback(Config):
    """Nobody is asked: for runs on the true reward."""

    kind: Literal["none"] = "none"


class Asking(Config):
    """What every kind of feedback has in common."""

    teacher: TeacherConfig = primary(
        default=Oracle(), description="Who answers: people on the labelling page, or a scripted teacher."
    )
    budget: int = primary(
        default=1400,
        ge=1,
        le=1_000_000,
        description="Answers in all. People: 'cannot tell' is free. Scripted teachers: every query counts.",
    )
    scheme: SchemeConfig = Field(Entropy(), description="How queries are chosen after the first session.")
    candidates_per_query: int = Field(
        10, ge=1, le=1000, description="Random pairs scored for each one asked."
    )
    pool_episodes: int = Field(100, ge=1, le=10_000, description="Finished episodes that segments come from.")
    segment_steps: int | None = Field(
        None, ge=1, le=1000, description="H, steps of a segment; empty: as many as last one second."
    )
    fit_every: int = Field(
        10, ge=1, le=10_000, description="While streaming, new answers that set off a fit before all are in."
    )
    patience_steps: int = Field(
        10_000,
        ge=1,
        le=10_000_000,
        description="While streaming, steps without a new answer after which training waits for one.",
    )


class Sessions(Asking):
    """Feedback sessions of M queries, K steps apart (Algorithm 2)."""

    kind: Literal["sessions"] = "sessions"
    queries_per_session: int = Field(140, ge=1, le=10_000, description="M, queries in one session.")
    steps_between: int = Field(
        20_000, ge=1, le=10_000_000, description="K, steps from one session to the next."
    )
    schedule: Literal["constant", "decreasing", "increasing"] = Field(
        "constant", description="Whether M stays, or falls or rises from its first value as steps go by."
    )
    pace: Literal["block", "stream"] = Field(
        "block",
        description="Block: training waits until a session is answered. Stream: training goes on meanwhile.",
    )


class Continuous(Asking):
    """A few fresh queries always ready; training goes on meanwhile."""

    kind: Literal["continuous"] = "continuous"
    ready: int = Field(3, ge=1, le=100, description="Open queries kept ready while budget remains.")
    fresh_steps: int = Field(
        5000, ge=1, le=10_000_000, description="Steps without an answer after which they are replaced."
    )


FeedbackConfig = Annotated[NoFeedback | Sessions | Continuous, Field(discriminator="kind")]
