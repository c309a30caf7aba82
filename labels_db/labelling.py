"""What the labelling page shows of a run: its queue as one labeller finds it, and what was taught so far."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import ColumnElement, Select, func, select, update
from sqlalchemy.orm import Session, joinedload

from labels_db.claims import queue_positions
from labels_db.errors import ConflictError
from labels_db.feedback_progress import FeedbackProgress, feedback_progress
from labels_db.leases import available_queries, held_leases, labeller_named
from labels_db.models import (
    Answer,
    EvaluationResult,
    Fit,
    Labeller,
    LabellerKind,
    Lease,
    Query,
    Run,
    RunState,
    Segment,
)
from labels_db.runs import config_of, get_run
from labels_db.standing import standing

NOBODY = 0
"""Labeller id of somebody who has not answered anything yet: no row has it."""


@dataclass(frozen=True)
class Queue:
    """A run's queries as one labeller finds them."""

    run: Run
    asks_people: bool
    total_steps: int
    steps_between: int
    """From one feedback session to the next; 0 where there are none."""
    progress: FeedbackProgress
    available: int
    """Queries that this labeller holds or could lease."""
    place: int | None
    """Place of the run among the queued ones, from 1."""
    video_step: int | None
    """Step of the latest policy video."""
    fits: int


def queue_of(session: Session, run_id: str, labeller_id: int, *, now: datetime) -> Queue:
    """The run's queue as that labeller finds it now."""
    run = get_run(session, run_id)
    config = config_of(run)
    queued = run.state is RunState.QUEUED
    return Queue(
        run=run,
        asks_people=config.asks_people,
        total_steps=config.total_steps,
        steps_between=getattr(config.feedback, "steps_between", 0),
        progress=feedback_progress(session, run),
        available=0 if run.archived else _available(session, run_id, labeller_id, now),
        place=queue_positions(session).get(run_id) if queued else None,
        video_step=session.scalar(select(func.max(EvaluationResult.step)).where(_with_video(run_id))),
        fits=session.scalar(select(func.count(Fit.id)).where(Fit.run_id == run_id)) or 0,
    )


def _available(session: Session, run_id: str, labeller_id: int, now: datetime) -> int:
    return _count(session, held_leases(run_id, labeller_id, now)) + _count(
        session, available_queries(run_id, labeller_id, now)
    )


def _count(session: Session, rows: Select[Lease] | Select[Query]) -> int:
    return session.scalar(select(func.count()).select_from(rows.order_by(None).subquery())) or 0


def _with_video(run_id: str) -> ColumnElement[bool]:
    return (EvaluationResult.run_id == run_id) & EvaluationResult.video_key.is_not(None)


def video_steps(session: Session, run_id: str) -> Sequence[int]:
    """The steps that have a policy video, in order."""
    wanted = select(EvaluationResult.step).where(_with_video(run_id)).order_by(EvaluationResult.step)
    return session.scalars(wanted).all()


def load_clips(session: Session, leases: Sequence[Lease]) -> None:
    """Fetch what is shown for those leases with one statement."""
    first = joinedload(Lease.query).joinedload(Query.first).joinedload(Segment.clip)
    second = joinedload(Lease.query).joinedload(Query.second).joinedload(Segment.clip)
    wanted = select(Lease).where(Lease.id.in_([lease.id for lease in leases])).options(first, second)
    session.scalars(wanted).all()


def last_answer(session: Session, run_id: str, labeller_id: int) -> Answer | None:
    """The labeller's latest answer that stands: what undo takes back."""
    return session.scalar(
        select(Answer)
        .where(Answer.run_id == run_id, Answer.labeller_id == labeller_id, standing())
        .order_by(Answer.sequence.desc())
        .limit(1)
    )


def choice_counts(session: Session, run_id: str) -> dict[str, int]:
    """How often each choice stands, by its name."""
    rows = session.execute(
        select(Answer.choice, func.count()).where(Answer.run_id == run_id, standing()).group_by(Answer.choice)
    )
    return {choice.value: count for choice, count in rows if choice is not None}


def find_person(session: Session, name: str) -> Labeller | None:
    """The person of that name, if known."""
    return session.scalar(select(Labeller).where(Labeller.name == name, Labeller.kind == LabellerKind.PERSON))


def name_person(session: Session, current: str, name: str, *, rename: bool, now: datetime) -> Labeller:
    """Who labels from now on: the person of that name, or the current one, renamed, when there is none.

    Whoever leaves gives their leases back.
    """
    before, after = find_person(session, current), find_person(session, name)
    if before is not None and after is None and rename:
        before.name = name
        return before
    if before is not None and before is not after:
        give_back_leases(session, before.id, now=now)
    return after or labeller_named(session, name)


def give_back_leases(session: Session, labeller_id: int, *, now: datetime) -> None:
    """Give back whatever that labeller has leased."""
    session.execute(
        update(Lease).where(Lease.labeller_id == labeller_id, Lease.expires_at > now).values(expires_at=now)
    )


def expect_open(run: Run) -> None:
    """ConflictError when the run no longer takes answers."""
    if run.archived:
        raise ConflictError(f"run {run.id}: archived, so its queries can no longer be answered")
