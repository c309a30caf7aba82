"""Scripted teachers, who stand in for people: from two true returns to a choice (B-Pref)."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Sequence

from sqlalchemy.orm import Session

from labels_db.models import Choice, LabellerKind, Pressed, Query, utc_now
from labels_db.queries import answer_query, labeller_named, lend
from labels_db.run_config import Human, Oracle

ScriptedTeacher = Callable[[float, float], Choice]
"""(true return of σ⁰, true return of σ¹) → choice."""

PRESSED = {
    Choice.FIRST: Pressed.LEFT,
    Choice.SECOND: Pressed.RIGHT,
    Choice.EQUAL: Pressed.EQUAL,
    Choice.SKIP: Pressed.SKIP,
}
"""The side a scripted teacher presses: it sees every query unswapped."""


def oracle(first: float, second: float) -> Choice:
    """Always the larger true return; an exact tie is equal."""
    if first == second:
        return Choice.EQUAL
    return Choice.FIRST if first > second else Choice.SECOND


SCRIPTED: dict[type, Callable[[Oracle], ScriptedTeacher]] = {Oracle: lambda _config: oracle}
"""Scripted teachers by the type of their configuration; people answer on their own."""


def scripted_teacher(config: Human | Oracle) -> ScriptedTeacher | None:
    """The configured teacher as a function, or None where people answer."""
    make = SCRIPTED.get(type(config))
    return make(config) if make and isinstance(config, Oracle) else None


def answer_all(session: Session, name: str, teacher: ScriptedTeacher, queries: Sequence[Query]) -> None:
    """Answer the queries that teacher `name` has not answered, through leases as a person would.

    The answer's id follows from run, query and teacher, so that nothing is ever answered twice.
    """
    labeller = labeller_named(session, name, LabellerKind.SCRIPTED)
    now = utc_now()
    for query in queries:
        choice = teacher(_true_return(query.first.true_return), _true_return(query.second.true_return))
        lease = lend(session, query.id, labeller.id, now, swapped=False)
        session.flush()
        answer_query(
            session,
            lease.id,
            labeller.id,
            answer_id=str(uuid.uuid5(uuid.NAMESPACE_URL, f"{query.run_id}/{query.id}/{name}")),
            pressed=PRESSED[choice],
            now=now,
        )


def _true_return(value: float | None) -> float:
    if value is None:
        raise ValueError("a scripted teacher needs the environment's true reward, and this one has none")
    return value
