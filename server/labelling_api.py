"""Lease, answer, retract, release: the labelling page's actions, for it and for any other client."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Path, Request, Response
from sqlalchemy.orm import Session

from labels_db.answers import answer_query, lease_of_answer, retract_answer
from labels_db.errors import ConflictError, NotFoundError
from labels_db.labelling import NOBODY, expect_open, find_person, name_person, queue_of
from labels_db.leases import labeller_named, lease_queries, own_lease, release_lease
from labels_db.models import Answer, Lease, Run, utc_now
from labels_db.runs import get_run
from server.api_refusals import REFUSED, UNKNOWN, refusal
from server.api_requests import RunId
from server.labelling_identity import PersonDep, remember
from server.labelling_models import (
    AnsweredOut,
    AnswerIn,
    Judged,
    LabellerIn,
    LabellerOut,
    LeasesIn,
    LeasesOut,
    QueueOut,
    RetractedOut,
    RetractionIn,
    RowId,
)
from server.labelling_payload import (
    leases_out,
    life_of,
    on_screen,
    queue_now,
    recorded_answer,
    retraction_out,
    shown,
)
from server.services import Services, ServicesDep

router = APIRouter(prefix="/api", tags=["labelling"], responses=REFUSED)

LeaseId = Annotated[RowId, Path(description="A lease of this labeller.")]

NOT_THEIRS = refusal(404, "No such run, or a lease or answer that is not this labeller's.")
OVER = refusal(409, "The run is archived, or what was sent is settled already.")


@router.get("/runs/{run_id}/queue", responses=UNKNOWN)
def queue(run_id: RunId, person: PersonDep, services: ServicesDep) -> QueueOut:
    """How far the answers have come and what the queue waits for; leases nothing."""
    with services.database.read() as session:
        me = find_person(session, person.name)
        return queue_now(session, run_id, me.id if me else NOBODY, utc_now())


@router.post("/runs/{run_id}/leases", responses=UNKNOWN | OVER)
def lease(run_id: RunId, wanted: LeasesIn, person: PersonDep, services: ServicesDep) -> LeasesOut:
    """Lend this labeller up to `count` pairs: those held, renewed for another minute, and fresh ones."""
    with services.database.write() as session:
        me = labeller_named(session, person.name).id
        return _next_leases(session, services, run_id, me, wanted.count, utc_now())


@router.post("/runs/{run_id}/answers", responses=NOT_THEIRS | OVER)
def answer(run_id: RunId, given: AnswerIn, person: PersonDep, services: ServicesDep) -> AnsweredOut:
    """Record an answer and lend the next pairs, in one transaction."""
    now = utc_now()
    with services.database.write() as session:
        me = labeller_named(session, person.name).id
        recorded = record_answer(session, run_id, me, given, now)
        after = _next_leases(session, services, run_id, me, given.count, now)
        return AnsweredOut(answer=recorded_answer(recorded), leases=after.leases, queue=after.queue)


@router.post("/runs/{run_id}/answers/{answer_id}/retract", responses=NOT_THEIRS | OVER)
def retract(
    run_id: RunId, answer_id: UUID, wish: RetractionIn, person: PersonDep, services: ServicesDep
) -> RetractedOut:
    """Take one's own answer back; its pair is lent again, on the same sides."""
    now = utc_now()
    with services.database.write() as session:
        me = labeller_named(session, person.name).id
        retraction, reopened = record_retraction(session, run_id, me, str(answer_id), wish, now)
        after = _next_leases(session, services, run_id, me, wish.count, now)
        return RetractedOut(
            retraction=retraction_out(retraction, str(answer_id)),
            lease=next(iter(shown(session, [reopened])), None),
            leases=after.leases,
            queue=after.queue,
        )


@router.post("/runs/{run_id}/leases/{lease_id}/release", status_code=204, responses=NOT_THEIRS)
def release(run_id: RunId, lease_id: LeaseId, person: PersonDep, services: ServicesDep) -> None:
    """Give a pair back unanswered, so that others need not wait for the lease to lapse. Takes no body."""
    with services.database.write() as session:
        me = find_person(session, person.name)
        lease_of_run(session, run_id, lease_id, me.id if me else NOBODY)
        release_lease(session, lease_id, me.id if me else NOBODY, now=utc_now())


@router.get("/labeller")
def labeller(person: PersonDep) -> LabellerOut:
    """Who labels with this client's cookies."""
    return LabellerOut(name=person.name, named=person.named)


@router.put("/labeller")
def be_somebody(
    wish: LabellerIn, person: PersonDep, request: Request, response: Response, services: ServicesDep
) -> LabellerOut:
    """Label under that name from now on. A made-up name is replaced, so that its answers stay one's own."""
    with services.database.write() as session:
        name_person(session, person.name, wish.name, rename=not person.named, now=utc_now())
    remember(request, response, wish.name)
    return LabellerOut(name=wish.name, named=True)


def record_answer(session: Session, run_id: str, labeller_id: int, given: AnswerIn, now: datetime) -> Answer:
    """The answer as recorded, be it now or when the same answer id first came."""
    _expect_judged(get_run(session, run_id), given)
    who = _speaks_for(session.get(Lease, given.lease_id), given.seen, labeller_id)
    lease_of_run(session, run_id, given.lease_id, who)
    return answer_query(
        session,
        given.lease_id,
        who,
        answer_id=str(given.answer_id),
        pressed=given.pressed,
        now=now,
        shown_at=given.shown_at,
        goal_card_version=given.goal_card_version,
    )


def record_retraction(
    session: Session, run_id: str, labeller_id: int, target_id: str, wish: RetractionIn, now: datetime
) -> tuple[Answer, Lease]:
    """The retraction as recorded, and the lease under which its pair is shown again."""
    _expect_judged(get_run(session, run_id), wish)
    who = _speaks_for(lease_of_answer(session, target_id), wish.seen, labeller_id)
    retraction, reopened = retract_answer(session, target_id, who, answer_id=str(wish.retraction_id), now=now)
    if retraction.run_id != run_id:
        reason = f"answer {target_id}: not of run {run_id}, so it cannot be taken back there"
        raise NotFoundError(reason, field="answer_id")
    return retraction, reopened


def _expect_judged(run: Run, judged: Judged) -> None:
    """NotFoundError when another data folder's run of that name was judged, ConflictError when this one is over."""
    if judged.life not in (None, life_of(run)):
        raise NotFoundError(
            f"run {run.id!r}: not the one that was on screen, which is in another data folder", field="run_id"
        )
    expect_open(run)


def _speaks_for(lease: Lease | None, seen: tuple[str, str] | None, labeller_id: int) -> int:
    """Whose answer it is: the name that a browser goes by may have changed since the pair was on its screen.

    ConflictError for another pair than was seen: a backup brought back gives out the numbers of leases again.
    """
    if lease is None or seen is None:
        return labeller_id
    if on_screen(lease) != list(seen):
        raise ConflictError(f"lease {lease.id}: it is of another pair than was on screen")
    return lease.labeller_id


def lease_of_run(session: Session, run_id: str, lease_id: int, labeller_id: int) -> Lease:
    found = own_lease(session, lease_id, labeller_id)
    if found.query.run_id != run_id:
        raise NotFoundError(f"lease {lease_id}: not of run {run_id}; ask for a new one", field="lease_id")
    return found


def _next_leases(
    session: Session, services: Services, run_id: str, labeller_id: int, count: int, now: datetime
) -> LeasesOut:
    leases = lease_queries(session, run_id, labeller_id, count=count, now=now, rng=services.rng)
    return leases_out(session, leases, queue_of(session, run_id, labeller_id, now=now), now)
