"""Use cases around commands: something asked of a run once, taken by one doer, answered with a result."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sqlalchemy import Select, select
from sqlalchemy.orm import Session

from labels_db.models import ALIVE, Command, Run, utc_now
from labels_db.runs import get_run


def ask(session: Session, run_id: str, kind: str, *, asked_by: str, **arguments: Any) -> Command:
    """Leave a command for the run's trainer, or for the supervisor once the run has ended."""
    get_run(session, run_id)
    command = Command(run_id=run_id, kind=kind, arguments=arguments, asked_by=asked_by, asked_at=utc_now())
    session.add(command)
    session.flush()
    return command


def take(session: Session, run_id: str, attempt: int, kinds: frozenset[str]) -> Command | None:
    """The oldest untaken command of those kinds, now this attempt's to do."""
    return _take(session, attempt, _waiting(kinds).where(Command.run_id == run_id))


def take_of_ended_runs(session: Session, kinds: frozenset[str]) -> Command | None:
    """The oldest untaken command of any run that no trainer owns."""
    return _take(session, 0, _waiting(kinds).join(Run).where(Run.state.not_in(ALIVE)))


def finish(session: Session, command_id: int, result: Mapping[str, Any]) -> None:
    """Leave what came of it."""
    command = session.get_one(Command, command_id)
    command.done_at, command.result = utc_now(), dict(result)


def _waiting(kinds: frozenset[str]) -> Select[Command]:
    return select(Command).where(Command.taken_at.is_(None), Command.kind.in_(kinds)).order_by(Command.id)


def _take(session: Session, attempt: int, wanted: Select[Command]) -> Command | None:
    command = session.scalar(wanted.limit(1))
    if command is not None:
        command.taken_at, command.taken_by_attempt = utc_now(), attempt
    return command
