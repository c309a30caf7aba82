"""Rows as the labelling page sees them: sides already swapped, and nothing that could lead an answer."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime

from sqlalchemy.orm import Session

from labels_db.labelling import Queue, load_clips, queue_of
from labels_db.models import Answer, Lease, Run, Segment
from server.api_replies import GoalOut
from server.artifacts import clip_address
from server.labelling_message import empty_message
from server.labelling_models import (
    ClipOut,
    LeaseOut,
    LeasesOut,
    QueueOut,
    RecordedAnswer,
    RetractionOut,
)


def leases_out(session: Session, leases: Sequence[Lease], queue: Queue, now: datetime) -> LeasesOut:
    """The labeller's pairs and the state of the queue."""
    return LeasesOut(leases=shown(session, leases), queue=queue_out(queue, now))


def shown(session: Session, leases: Sequence[Lease]) -> list[LeaseOut]:
    """Those of the leases that can be shown: both clips are rendered."""
    load_clips(session, leases)
    return [lease_out(lease) for lease in leases if lease.query.first.clip and lease.query.second.clip]


def lease_out(lease: Lease) -> LeaseOut:
    first, second = lease.query.first, lease.query.second
    left, right = (second, first) if lease.swapped else (first, second)
    return LeaseOut(
        lease_id=lease.id,
        query_id=lease.query_id,
        expires_at=lease.expires_at,
        left=_clip(left),
        right=_clip(right),
    )


def on_screen(lease: Lease) -> list[str]:
    """The addresses of the left and the right clip, for as long as there are both."""
    first, second = lease.query.first.clip, lease.query.second.clip
    sides = (second, first) if lease.swapped else (first, second)
    return [clip_address(clip) for clip in sides if clip]


def _clip(segment: Segment) -> ClipOut:
    clip = segment.clip
    assert clip is not None, f"segment {segment.id} has no clip"
    return ClipOut(
        url=clip_address(clip),
        frames=clip.frames,
        rows=clip.rows,
        columns=clip.columns,
        width=clip.width,
        height=clip.height,
        duration=clip.duration,
        times=clip.times,
    )


def life_of(run: Run) -> str:
    """What tells a run from one of the same name in another data folder."""
    return f"{run.id}:{run.created_at.timestamp()}"


def queue_out(queue: Queue, now: datetime) -> QueueOut:
    progress = queue.progress
    return QueueOut(
        life=life_of(queue.run),
        state=queue.run.state,
        given=progress.given,
        budget=progress.budget,
        remaining=progress.remaining,
        open=progress.open,
        available=queue.available,
        rendering=progress.rendering,
        message=None if queue.available else empty_message(queue, now),
        goal=GoalOut.model_validate(queue.run.goal),
        taught=f"{queue.video_step}-{queue.fits}",
    )


def queue_now(session: Session, run_id: str, labeller_id: int, now: datetime) -> QueueOut:
    return queue_out(queue_of(session, run_id, labeller_id, now=now), now)


def recorded_answer(answer: Answer) -> RecordedAnswer:
    assert answer.lease_id is not None, "a retraction is no answer"
    assert answer.pressed is not None, "a retraction is no answer"
    return RecordedAnswer(
        answer_id=answer.answer_id,
        lease_id=answer.lease_id,
        query_id=answer.query_id,
        pressed=answer.pressed,
        sequence=answer.sequence,
        answered_at=answer.answered_at,
    )


def retraction_out(retraction: Answer, target_id: str) -> RetractionOut:
    return RetractionOut(
        retraction_id=retraction.answer_id, answer_id=target_id, sequence=retraction.sequence
    )
