"""Where the record says a clip or a video lies."""

from __future__ import annotations

from sqlalchemy import select
from sqlalchemy.orm import Session

from labels_db.errors import NotFoundError
from labels_db.models import Clip, EvaluationResult


def clip_of(session: Session, segment_id: int) -> Clip:
    """The segment's rendered clip."""
    clip = session.get(Clip, segment_id)
    if clip is None:
        raise NotFoundError(f"clip {segment_id}: there is none; its segment was never rendered")
    return clip


def video_of(session: Session, run_id: str, step: int) -> str:
    """The key of the video of the run's evaluation at that step."""
    wanted = select(EvaluationResult.video_key).where(
        EvaluationResult.run_id == run_id, EvaluationResult.step == step
    )
    key = session.scalar(wanted)
    if key is None:
        raise NotFoundError(f"video of run {run_id!r} at step {step}: there is none")
    return key
