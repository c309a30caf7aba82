"""Use cases around who looks: labellers, and the queries lent to them for a while, on which sides."""

from __future__ import annotations

import functools
import random
from datetime import datetime, timedelta

from sqlalchemy import ColumnElement, Select, exists, func, select
from sqlalchemy.orm import Session

from labels_db.errors import ConflictError, NotFoundError
from labels_db.models import Answer, Labeller, LabellerKind, Lease, Query, QueryState, utc_now
from labels_db.runs import get_run
from labels_db.standing import standing

LEASE_TIME = timedelta(seconds=60)


def labeller_named(session: Session, name: str, kind: LabellerKind = LabellerKind.PERSON) -> Labeller:
    """The labeller of that name, made when new."""
    found = session.scalar(select(Labeller).where(Labeller.name == name, Labeller.kind == kind))
    if found is None:
        found = Labeller(name=name, kind=kind, created_at=utc_now())
        session.add(found)
        session.flush()
    return found


def lease_queries(
    session: Session, run_id: str, labeller_id: int, *, count: int, now: datetime, rng: random.Random
) -> list[Lease]:
    """Up to `count` leases of that labeller: the ones held, renewed, then fresh ones; the oldest query comes first.

    A query is available while standing answers and others' leases are fewer than needed, and the labeller
    has neither. Sides are swapped at random once; a lease that lapsed or was given back comes back to its
    labeller with the same sides, so that a reloaded page shows the same pair.
    """
    run = get_run(session, run_id)
    if run.archived:
        raise ConflictError(f"run {run_id}: archived, so its queries can no longer be answered")
    held = list(session.scalars(held_leases(run_id, labeller_id, now).limit(count)))
    for lease in held:
        lease.expires_at = now + LEASE_TIME
    fresh = session.scalars(available_queries(run_id, labeller_id, now).limit(count - len(held))).all()
    leases = held + [_lend_again_or_anew(session, query.id, labeller_id, now, rng) for query in fresh]
    session.flush()
    return sorted(leases, key=lambda lease: (lease.query.session_id, lease.query.index))


def _lend_again_or_anew(
    session: Session, query_id: int, labeller_id: int, now: datetime, rng: random.Random
) -> Lease:
    earlier = session.scalar(
        select(Lease)
        .where(
            Lease.query_id == query_id,
            Lease.labeller_id == labeller_id,
            unanswered(),
        )
        .order_by(Lease.id.desc())
        .limit(1)
    )
    if earlier is None:
        return lend(session, query_id, labeller_id, now, swapped=rng.random() < 0.5)
    earlier.expires_at = now + LEASE_TIME
    return earlier


def lend(session: Session, query_id: int, labeller_id: int, now: datetime, *, swapped: bool) -> Lease:
    """A fresh lease; `lease_queries` sees to who may have one."""
    lease = Lease(
        query_id=query_id,
        labeller_id=labeller_id,
        swapped=swapped,
        granted_at=now,
        expires_at=now + LEASE_TIME,
    )
    session.add(lease)
    return lease


def release_lease(session: Session, lease_id: int, labeller_id: int, *, now: datetime) -> None:
    """Give a query back unanswered."""
    lease = own_lease(session, lease_id, labeller_id)
    lease.expires_at = min(lease.expires_at, now)


def own_lease(session: Session, lease_id: int, labeller_id: int) -> Lease:
    """The labeller's lease of that number; NotFoundError for anybody else's."""
    lease = session.get(Lease, lease_id)
    if lease is None or lease.labeller_id != labeller_id:
        raise NotFoundError(f"lease {lease_id}: not yours; ask for a new one", field="lease_id")
    return lease


def held_leases(run_id: str, labeller_id: int, now: datetime) -> Select[Lease]:
    """The labeller's valid, unanswered leases of the run, oldest query first."""
    return (
        select(Lease)
        .join(Lease.query)
        .where(
            Query.run_id == run_id,
            Query.state == QueryState.OPEN,
            Lease.labeller_id == labeller_id,
            Lease.expires_at > now,
            unanswered(),
        )
        .order_by(Query.session_id, Query.index)
    )


def available_queries(run_id: str, labeller_id: int, now: datetime) -> Select[Query]:
    """The run's queries that the labeller could lease besides the ones held, oldest first."""
    answered = (Answer.query_id == Query.id, standing())
    lent = (Lease.query_id == Query.id, Lease.expires_at > now, unanswered())
    answers = select(func.count(Answer.id)).where(*answered).scalar_subquery()
    leases = select(func.count(Lease.id)).where(*lent).scalar_subquery()
    return (
        select(Query)
        .where(
            Query.run_id == run_id,
            Query.state == QueryState.OPEN,
            answers + leases < Query.answers_needed,
            ~exists().where(*answered, Answer.labeller_id == labeller_id),
            ~exists().where(*lent, Lease.labeller_id == labeller_id),
        )
        .order_by(Query.session_id, Query.index)
    )


@functools.cache  # building it anew costs more than running it
def unanswered() -> ColumnElement[bool]:
    """Condition on `Lease`: no answer was ever given through it."""
    return ~exists().where(Answer.lease_id == Lease.id)
