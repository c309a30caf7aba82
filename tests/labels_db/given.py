"""Rows that stories about the record begin with."""

from __future__ import annotations

import random
from datetime import UTC, datetime, timedelta

from sqlalchemy.orm import Session

from labels_db.answers import answer_query
from labels_db.claims import Claim, claim
from labels_db.feedback_sessions import open_session, post_query
from labels_db.leases import labeller_named, lease_queries
from labels_db.models import Answer, Lease, Pressed, Query, Run, Segment
from labels_db.overrides import with_settings
from labels_db.presets import preset_named
from labels_db.runs import request_run

NOW = datetime(2026, 3, 1, 12, 0, tzinfo=UTC)
SECOND = timedelta(seconds=1)
HUMAN = preset_named("cartpole-windmill-clockwise").config()
SCRIPTED = preset_named("cartpole-swingup").config()


def a_run(session: Session, run_id: str = "mill", *, at: datetime = NOW, budget: int = 50) -> Run:
    """A queued run that asks people."""
    config = with_settings(HUMAN, {"feedback.budget": str(budget)})
    run = request_run(session, config, title="Windmill", goal="Round and round.", run_id=run_id)
    run.queued_at = at
    return run


def a_claim(session: Session, run_id: str = "mill", *, at: datetime = NOW, budget: int = 50) -> Claim:
    """A run that an attempt owns."""
    return claim(session, a_run(session, run_id, budget=budget), "tester", now=at)


def queries(
    session: Session, owner: Claim, count: int, *, answers_needed: int = 1, session_index: int = 0
) -> list[Query]:
    """Queries of the run's first session, or of a later one."""
    opened = open_session(session, owner, index=session_index, step=1000 * (session_index + 1), asked=count)
    return [
        post_query(
            session,
            owner,
            opened,
            index=index,
            segments=(a_segment(owner.run_id, 2 * index), a_segment(owner.run_id, 2 * index + 1)),
            scheme="uniform",
            score=None,
            answers_needed=answers_needed,
        )
        for index in range(count)
    ]


def a_segment(run_id: str, number: int) -> Segment:
    """A segment whose artifact nobody looks at."""
    return Segment(
        run_id=run_id,
        episode=number,
        start=0,
        length=25,
        policy_step=0,
        artifact_key=f"runs/{run_id}/segments/{number}",
        checksum="",
        true_return=float(number),
    )


def labeller(session: Session, name: str = "ann") -> int:
    """A person's id."""
    return labeller_named(session, name).id


def leases(
    session: Session, person: int, count: int = 1, *, at: datetime = NOW, run_id: str = "mill"
) -> list[Lease]:
    """What that person is lent."""
    return lease_queries(session, run_id, person, count=count, now=at, rng=random.Random(1))


def an_answer(
    session: Session,
    lease: Lease,
    answer_id: str = "a-1",
    *,
    pressed: Pressed = Pressed.LEFT,
    at: datetime = NOW,
) -> Answer:
    """The lease's holder presses a side."""
    return answer_query(session, lease.id, lease.labeller_id, answer_id=answer_id, pressed=pressed, now=at)
