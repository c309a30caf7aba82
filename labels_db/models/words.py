"""Words that columns hold: states, wishes, choices."""

from __future__ import annotations

from enum import StrEnum


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


ALIVE = (RunState.STARTING, RunState.RUNNING, RunState.WAITING, RunState.PAUSED)
"""States in which an attempt owns the run."""

ENDED = (RunState.FINISHED, RunState.FAILED, RunState.STOPPED)
"""States that the run leaves only when somebody asks for it."""


class Desired(StrEnum):
    """What people want of a run; its trainer obeys."""

    RUN = "run"
    PAUSE = "pause"
    STOP = "stop"


class Phase(StrEnum):
    """What a trainer is doing; `server/sentences.py` and `server/labelling_message.py` have words for each."""

    STARTING = "starting"
    SEEDING = "seeding"
    EXPLORING = "exploring"
    ASKING = "asking"
    WAITING = "waiting"
    FITTING = "fitting"
    RELABELLING = "relabelling"
    TRAINING = "training"
    EVALUATING = "evaluating"
    CHECKPOINTING = "checkpointing"
    PAUSED = "paused"


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
