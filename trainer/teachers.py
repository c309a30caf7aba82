"""Scripted teachers, who stand in for people: from two true returns to a choice (B-Pref)."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Sequence
from typing import Any

from sqlalchemy.orm import Session

from labels_db.answers import answer_query, pressed_for
from labels_db.leases import labeller_named, lend
from labels_db.models import Choice, LabellerKind, Query, utc_now
from labels_db.run_config import Config, Human, Oracle

ScriptedTeacher = Callable[[float | None, float | None], Choice]
"""(true return of σ⁰, true return of σ¹) → choice."""


def oracle(first: float | None, second: float | None) -> Choice:
    """Always the larger true return; an exact tie is equal."""
    if first is None or second is None:
        raise ValueError("a scripted teacher needs the environment's true reward, and this one has none")
    if first == second:
        return Choice.EQUAL
    return Choice.FIRST if first > second else Choice.SECOND


SCRIPTED: dict[type[Config], Callable[[Any], ScriptedTeacher]] = {Oracle: lambda _config: oracle}
"""Scripted teachers by the type of their configuration; people answer on their own."""


def scripted_teacher(config: Human | Oracle) -> ScriptedTeacher | None:
    """The configured teacher as a function, or None where people answer."""
    make = SCRIPTED.get(type(config))
    return make(config) if make else None


def scripted_teacher_named(kind: str) -> ScriptedTeacher:
    """The scripted teacher of that kind with its default settings; ValueError names the ones there are."""
    known = {str(config.model_fields["kind"].default): config for config in SCRIPTED}
    if kind not in known:
        raise ValueError(f"{kind!r}: unknown; one of {', '.join(known)}")
    return SCRIPTED[known[kind]](known[kind]())


def answer_all(session: Session, name: str, teacher: ScriptedTeacher, queries: Sequence[Query]) -> None:
    """Answer the queries that teacher `name` has not answered, through leases as a person would.

    The answer's id follows from run, query and teacher, so that nothing is ever answered twice.
    """
    labeller = labeller_named(session, name, LabellerKind.SCRIPTED)
    now = utc_now()
    for query in queries:  # unanswered ones: what an earlier attempt posted it has answered as well
        choice = teacher(query.first.true_return, query.second.true_return)
        lease = lend(session, query.id, labeller.id, now, swapped=False)
        session.flush()
        answer_query(
            session,
            lease.id,
            labeller.id,
            answer_id=str(uuid.uuid5(uuid.NAMESPACE_URL, f"{query.run_id}/{query.id}/{name}")),
            pressed=pressed_for(choice, swapped=False),
            now=now,
        )
