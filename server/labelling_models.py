"""What the labelling API takes and gives: nothing says which side is first, or what a segment is worth."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal
from uuid import UUID

from pydantic import AfterValidator, AwareDatetime, BaseModel, Field, StringConstraints

from labels_db.models import Pressed, RunState
from server.api_replies import GoalOut
from server.api_requests import LARGEST, Asked

MAX_LEASES = 8


def _plausible(moment: datetime) -> datetime:
    if not 1970 <= moment.year < 3000:
        raise ValueError("not a time at which a pair can have been shown")
    return moment


RowId = Annotated[int, Field(ge=1, le=LARGEST)]
Moment = Annotated[AwareDatetime, AfterValidator(_plausible)]
PersonName = Annotated[
    str, StringConstraints(strip_whitespace=True, min_length=1, max_length=60, pattern=r"^[^\x00-\x1f\x7f]+$")
]


class LeasesIn(Asked):
    count: int = Field(4, ge=1, le=MAX_LEASES, description="Leases wanted in all, held ones included.")


class Judged(Asked):
    """What was on screen when somebody judged it; a client that does not say so is taken at its word."""

    life: str | None = Field(
        None,
        max_length=400,
        description="The queue's `life`: a run of that name in another data folder is refused.",
    )
    seen: tuple[str, str] | None = Field(
        None,
        description="Addresses of the left and the right clip. Whoever tells them speaks for the labeller to whom that"
        " pair was lent, whatever name the client goes by now; the lease must be that pair's.",
    )


class AnswerIn(Judged):
    answer_id: UUID = Field(description="Made by the client; sent again, it changes nothing.")
    lease_id: RowId = Field(description="The lease under which the pair was shown.")
    pressed: Pressed = Field(description="The side preferred as shown, `equal`, or `skip` for cannot tell.")
    shown_at: Moment | None = Field(None, description="When the pair appeared, with offset from UTC.")
    goal_card_version: int | None = Field(None, ge=1, le=1_000_000, description="The goal card shown.")
    count: int = Field(1, ge=0, le=MAX_LEASES, description="Leases wanted in the reply, held ones included.")


class RetractionIn(Judged):
    retraction_id: UUID = Field(description="Made by the client; sent again, it changes nothing.")
    count: int = Field(1, ge=0, le=MAX_LEASES, description="Leases wanted in the reply, held ones included.")


class LabellerIn(Asked):
    name: PersonName = Field(description="Who labels in this browser from now on.")


class ClipOut(BaseModel):
    """A sprite sheet, and how to play it."""

    url: str
    frames: int
    rows: int
    columns: int
    width: int = Field(description="Pixels across one frame.")
    height: int = Field(description="Pixels down one frame.")
    duration: float = Field(description="Seconds the clip lasts.")
    times: list[float] = Field(description="Seconds at which each frame appears.")


class LeaseOut(BaseModel):
    """A pair lent to this labeller, on the sides where it is to be shown."""

    lease_id: int
    query_id: int
    expires_at: datetime
    left: ClipOut
    right: ClipOut


MessageKind = Literal[
    "archived",
    "scripted",
    "finished",
    "failed",
    "stopped",
    "answered",
    "queued",
    "starting",
    "paused",
    "silent",
    "rendering",
    "others",
    "waiting",
    "training",
]


class MessageOut(BaseModel):
    """Why there is no pair just now."""

    kind: MessageKind
    sentence: str
    over: bool = Field(description="No more pairs come, unless somebody asks more of the run.")
    seconds: float | None = Field(None, description="Until the next pairs, where that is known.")


class QueueOut(BaseModel):
    """How far the run's answers have come, and what its queue waits for."""

    life: str = Field(
        description="The run's name and beginning: a run of that name in another data folder began at another time."
    )
    state: RunState
    given: int = Field(description="Answers that count towards the budget.")
    budget: int
    remaining: int
    open: int = Field(description="Queries posted and not answered, by anybody.")
    available: int = Field(description="Queries that this labeller holds or could lease.")
    rendering: int = Field(description="Queries asked whose clips are still being drawn.")
    message: MessageOut | None = Field(description="Why there is no pair; absent while there are some.")
    goal: GoalOut
    taught: str = Field(description="Changes whenever there is a new policy video or fit.")


class LeasesOut(BaseModel):
    leases: list[LeaseOut]
    queue: QueueOut


class RecordedAnswer(BaseModel):
    """An answer as it is recorded."""

    answer_id: str
    lease_id: int
    query_id: int
    pressed: Pressed
    sequence: int
    answered_at: datetime


class AnsweredOut(LeasesOut):
    answer: RecordedAnswer


class RetractionOut(BaseModel):
    retraction_id: str
    answer_id: str
    sequence: int


class RetractedOut(LeasesOut):
    retraction: RetractionOut
    lease: LeaseOut | None = Field(description="The pair again, on the same sides.")


class LabellerOut(BaseModel):
    name: str
    named: bool = Field(description="False while the browser goes by a name that nobody chose.")
