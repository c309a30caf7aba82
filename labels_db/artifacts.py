"""Where the record says a clip, a video or an exported policy lies."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import PurePosixPath

from sqlalchemy import select
from sqlalchemy.orm import Session

from labels_db.errors import NotFoundError
from labels_db.models import Clip, Command, EvaluationResult


def content_of(clip: Clip) -> str:
    """What tells its picture from any other's: segments are numbered from 1 in every data folder."""
    return clip.checksum[:16]


def clip_of(session: Session, segment_id: int, content: str | None = None) -> Clip:
    """The segment's rendered clip, if it has that content."""
    clip = session.get(Clip, segment_id)
    if clip is None:
        raise NotFoundError(
            f"clip {segment_id}: there is none; its segment was never rendered", field="segment_id"
        )
    if content not in (None, content_of(clip)):
        raise NotFoundError(f"clip {segment_id}: it is another one than {content}", field="content")
    return clip


def video_of(session: Session, run_id: str, step: int) -> str:
    """The key of the video of the run's evaluation at that step."""
    wanted = select(EvaluationResult.video_key).where(
        EvaluationResult.run_id == run_id, EvaluationResult.step == step
    )
    key = session.scalar(wanted)
    if key is None:
        raise NotFoundError(f"video of run {run_id!r} at step {step}: there is none", field="step")
    return key


@dataclass(frozen=True)
class Export:
    """An exported policy in the store."""

    key: str
    checksum: str

    @property
    def name(self) -> str:
        """What to call the file: the last part of its key, so letters, digits, dots and dashes only."""
        return PurePosixPath(self.key).name


def export_of(session: Session, run_id: str, command_id: int) -> Export:
    """What that command of the run exported."""
    command = session.get(Command, command_id)
    result = None if command is None or command.run_id != run_id else command.result
    if result is None or "artifact" not in result:
        raise NotFoundError(
            f"export {command_id} of run {run_id!r}: there is none; the run's page lists them",
            field="command_id",
        )
    return Export(result["artifact"], result["sha256"])
