"""Use cases around commands: something asked of a run once, taken by one doer, answered with a result."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import timedelta
from typing import Any

from sqlalchemy import ColumnElement, Select, and_, or_, select
from sqlalchemy.orm import Session

from labels_db.models import ALIVE, Command, Run, utc_now
from labels_db.runs import get_run

GIVEN_UP_AFTER = timedelta(minutes=15)
"""A taker that has left no result for so long is dead: an evaluation, a video or an export takes it a few minutes."""


def ask(session: Session, run_id: str, kind: str, *, asked_by: str, **arguments: Any) -> Command:
    """Leave a command for the run's trainer, or for the supervisor once the run has ended."""
    get_run(session, run_id)
    command = Command(run_id=run_id, kind=kind, arguments=arguments, asked_by=asked_by, asked_at=utc_now())
    session.add(command)
    session.flush()
    return command


def take(session: Session, run_id: str, attempt: int, kinds: frozenset[str]) -> Command | None:
    """The oldest untaken command of those kinds, now this attempt's to do."""
    return _take(session, attempt, _of(kinds).where(_untaken(), Command.run_id == run_id))


def take_of_ended_runs(session: Session, kinds: frozenset[str]) -> Command | None:
    """The oldest command of any run that no trainer owns: untaken, or taken by somebody who died over it."""
    waiting = _of(kinds).where(or_(_untaken(), _given_up()))
    return _take(session, 0, waiting.join(Run).where(Run.state.not_in(ALIVE)))


def finish(session: Session, command_id: int, result: Mapping[str, Any]) -> None:
    """Leave what came of it."""
    command = session.get_one(Command, command_id)
    command.done_at, command.result = utc_now(), dict(result)


def give_up(session: Session, command_id: int, reason: str) -> None:
    """Leave the reason why nothing came of it, unless something did."""
    if session.get_one(Command, command_id).done_at is None:
        finish(session, command_id, {"error": reason})


def _of(kinds: frozenset[str]) -> Select[Command]:
    return select(Command).where(Command.kind.in_(kinds)).order_by(Command.id)


def _untaken() -> ColumnElement[bool]:
    return Command.taken_at.is_(None)


def _given_up() -> ColumnElement[bool]:
    return and_(Command.done_at.is_(None), Command.taken_at < utc_now() - GIVEN_UP_AFTER)


def _take(session: Session, attempt: int, wanted: Select[Command]) -> Command | None:
    command = session.scalar(wanted.limit(1))
    if command is not None:
        command.taken_at, command.taken_by_attempt = utc_now(), attempt
    return command
