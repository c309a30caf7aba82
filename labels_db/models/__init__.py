"""The tables. What each row means, and who writes it, is in `docs/architecture.md`."""

from labels_db.models.answers import Answer, Invite, Labeller, Lease
from labels_db.models.base import Base, Moment, utc_now
from labels_db.models.learning import EvaluationResult, Fit, Metric, QueryScore
from labels_db.models.queries import Clip, FeedbackSession, Query, Segment
from labels_db.models.runs import Checkpoint, Command, Event, ExperimentTitle, GoalCard, Run
from labels_db.models.words import (
    ALIVE,
    ENDED,
    Choice,
    Desired,
    LabellerKind,
    Phase,
    Pressed,
    QueryState,
    RunState,
)

__all__ = [
    "ALIVE",
    "ENDED",
    "Answer",
    "Base",
    "Checkpoint",
    "Choice",
    "Clip",
    "Command",
    "Desired",
    "EvaluationResult",
    "Event",
    "ExperimentTitle",
    "FeedbackSession",
    "Fit",
    "GoalCard",
    "Invite",
    "Labeller",
    "LabellerKind",
    "Lease",
    "Metric",
    "Moment",
    "Phase",
    "Pressed",
    "Query",
    "QueryScore",
    "QueryState",
    "Run",
    "RunState",
    "Segment",
    "utc_now",
]
