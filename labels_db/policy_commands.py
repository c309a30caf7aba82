"""Use cases around an ended run's policy: what may be asked of it, and what was."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, Literal

from sqlalchemy import select
from sqlalchemy.orm import Session

from labels_db.commands import ask
from labels_db.errors import ConflictError
from labels_db.models import ENDED, Command, Run
from labels_db.records import checkpoints_of, evaluation, evaluation_at
from labels_db.runs import config_of, get_run

PolicyCommand = Literal["evaluate", "video", "export-policy"]

TAKES: Mapping[PolicyCommand, Mapping[str, Any]] = MappingProxyType(
    {"evaluate": {"episodes": 10}, "video": {}, "export-policy": {"format": "onnx"}}
)
"""What each command may be told, and what it takes where it is not."""

POLICY_COMMANDS: frozenset[str] = frozenset(TAKES)


def ask_of_policy(
    session: Session, run_id: str, kind: PolicyCommand, *, asked_by: str, **arguments: Any
) -> Command:
    """Leave a command that needs a run's last checkpoint, once no trainer will write another."""
    run = get_run(session, run_id)
    if run.state not in ENDED:
        raise ConflictError(
            f"run {run_id}: cannot {kind} while {run.state}; its policy is there to take once it has ended"
        )
    if not checkpoints_of(session, run_id):
        raise ConflictError(
            f"run {run_id}: cannot {kind}; it ended without a checkpoint, so has no policy yet"
        )
    if kind == "video" and not video_missing(session, run):
        raise ConflictError(
            f"run {run_id}: no video to make; its last policy has one already, or its environment no picture"
        )
    return ask(session, run_id, kind, asked_by=asked_by, **{**TAKES[kind], **arguments})


def video_missing(session: Session, run: Run) -> bool:
    """Whether the policy of the run's last checkpoint could be seen and has not been drawn yet."""
    saved = checkpoints_of(session, run.id)
    config = config_of(run)
    if not saved or not config.environment.is_known or not config.catalogue_entry.can_be_drawn:
        return False
    found = evaluation_at(session, run.id, saved[0].step)
    return found is None or found.video_key is None


def keep_video(
    session: Session,
    run_id: str,
    *,
    step: int,
    returns: Sequence[float],
    measures: Mapping[str, float],
    video_key: str,
) -> None:
    """A video of the policy at that step; where no evaluation is there, this one is kept as well.

    ConflictError where the run has gone on meanwhile: its trainer alone says now what was evaluated when.
    """
    run = get_run(session, run_id)
    if run.state not in ENDED:
        raise ConflictError(f"run {run_id}: goes on, so the video was not kept; ask again once it has ended")
    found = evaluation_at(session, run_id, step)
    if found is None:
        found = evaluation(run_id, step=step, returns=returns, measures=measures)
        session.add(found)
    found.video_key = video_key


def policy_commands_of(session: Session, run_id: str, *, limit: int) -> Sequence[Command]:
    """What was asked of the run's policy, the latest first."""
    wanted = select(Command).where(Command.run_id == run_id, Command.kind.in_(POLICY_COMMANDS))
    return session.scalars(wanted.order_by(Command.id.desc()).limit(limit)).all()
