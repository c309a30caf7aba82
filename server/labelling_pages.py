"""The labelling page, its fragments, and the plain forms that serve where scripts do not run."""

from __future__ import annotations

import uuid
from datetime import datetime
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Form, Request
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse, Response

from labels_db.errors import ConflictError
from labels_db.labelling import NOBODY, Queue, choice_counts, last_answer, name_person, queue_of, video_steps
from labels_db.leases import labeller_named, lease_queries
from labels_db.models import Pressed, utc_now
from labels_db.records import fits_of
from server.labelling_api import record_answer, record_retraction
from server.labelling_identity import Person, person_of, remember
from server.labelling_models import (
    AnswerIn,
    ClipOut,
    Judged,
    LeaseOut,
    Moment,
    PersonName,
    RetractionIn,
    RowId,
)
from server.labelling_payload import on_screen, queue_out, shown
from server.services import Services, ServicesDep
from server.templating import render

router = APIRouter(prefix="/runs/{run_id}/label", include_in_schema=False)

STRIP_FRAMES = 8
NOTES = {
    "lost": "That pair was answered already, or is another one by now, so nothing was recorded. Here is the next one.",
    "undone": "Taken back. Here is that pair again.",
}


@router.get("")
def page(request: Request, run_id: str, services: ServicesDep, note: str = "") -> Response:
    """The page. One pair is leased at once, for those who see it without scripts."""
    person = person_of(request)
    with services.database.write() as session:
        context = _page_context(session, services, run_id, person)
    response = _render(request, "label.html", **context, note=NOTES.get(note, ""))
    if not person.known:
        remember(request, response, person.name)
    return response


def _page_context(session: Session, services: Services, run_id: str, person: Person) -> dict[str, Any]:
    now, me = utc_now(), labeller_named(session, person.name).id
    queue = queue_of(session, run_id, me, now=now)
    undoable = last_answer(session, run_id, me)
    return {
        "run": queue.run,
        "queue": queue_out(queue, now),
        "taught": _taught(session, queue),
        "person": person,
        "pair": _first_pair(session, services, queue, me, now),
        "strip": strip,
        "undoable": undoable
        and undoable.lease
        and {"answer_id": undoable.answer_id, "seen": on_screen(undoable.lease)},
        # The forms' own ids, so that a form sent twice counts once.
        "answer_id": uuid.uuid4(),
        "retraction_id": uuid.uuid4(),
        "shown_at": now.isoformat(),
    }


def _first_pair(
    session: Session, services: Services, queue: Queue, labeller_id: int, now: datetime
) -> LeaseOut | None:
    if queue.run.archived:
        return None
    leases = lease_queries(session, queue.run.id, labeller_id, count=1, now=now, rng=services.rng)
    return next(iter(shown(session, leases)), None)


def strip(clip: ClipOut) -> list[str]:
    """The view boxes that cut some evenly spaced frames out of a sprite sheet."""
    count = min(STRIP_FRAMES, clip.frames)
    chosen = [round(place * (clip.frames - 1) / max(1, count - 1)) for place in range(count)]
    places = [divmod(frame, clip.columns) for frame in chosen]
    width, height = clip.width, clip.height
    return [f"{column * width} {row * height} {width} {height}" for row, column in places]


@router.get("/taught")
def taught(request: Request, run_id: str, services: ServicesDep) -> Response:
    """What the answers have taught so far: the fragment below the clips."""
    return _fragment(request, "label_taught.html", run_id, services)


@router.get("/summary")
def summary(request: Request, run_id: str, services: ServicesDep) -> Response:
    """What the answers did, once all are given."""
    return _fragment(request, "label_summary.html", run_id, services)


def _fragment(request: Request, template: str, run_id: str, services: Services) -> Response:
    with services.database.read() as session:
        queue = queue_of(session, run_id, NOBODY, now=utc_now())
        return _render(request, template, run=queue.run, taught=_taught(session, queue))


def _taught(session: Session, queue: Queue) -> dict[str, object]:
    """Videos, fits and counts. Of returns nothing: a labeller is to judge by the clips alone."""
    fits = [fit for fit in fits_of(session, queue.run.id) if fit.fresh_accuracy is not None]
    steps = video_steps(session, queue.run.id)
    return {
        "given": queue.progress.given,
        "counts": choice_counts(session, queue.run.id),
        "first_video": steps[0] if len(steps) > 1 else None,
        "latest_video": steps[-1] if steps else None,
        "first_fit": fits[0] if len(fits) > 1 else None,
        "latest_fit": fits[-1] if fits else None,
    }


def _render(request: Request, template: str, **context: Any) -> Response:
    return render(request, template, headers={"Cache-Control": "no-store"}, **context)


def judged_by_form(
    life: Annotated[str, Form(max_length=400)], left: Annotated[str, Form()], right: Annotated[str, Form()]
) -> Judged:
    """What the form's own page showed."""
    return Judged(life=life, seen=(left, right))


@router.post("/answer")
def answer(
    request: Request,
    run_id: str,
    services: ServicesDep,
    lease_id: Annotated[RowId, Form()],
    answer_id: Annotated[uuid.UUID, Form()],
    pressed: Annotated[Pressed, Form()],
    judged: Annotated[Judged, Depends(judged_by_form)],
    shown_at: Annotated[Moment | None, Form()] = None,
) -> Response:
    """Record an answer given by a form, then show the next pair."""
    told = judged.model_dump()
    given = AnswerIn(answer_id=answer_id, lease_id=lease_id, pressed=pressed, shown_at=shown_at, **told)
    try:
        with services.database.write() as session:
            me = labeller_named(session, person_of(request).name)
            record_answer(session, run_id, me.id, given, utc_now())
    except ConflictError:
        return _back(run_id, "lost")
    return _back(run_id)


@router.post("/undo")
def undo(
    request: Request,
    run_id: str,
    services: ServicesDep,
    answer_id: Annotated[uuid.UUID, Form()],
    retraction_id: Annotated[uuid.UUID, Form()],
    judged: Annotated[Judged, Depends(judged_by_form)],
) -> Response:
    """Take an answer back by a form, then show its pair again."""
    with services.database.write() as session:
        me = labeller_named(session, person_of(request).name)
        try:
            wish = RetractionIn(retraction_id=retraction_id, **judged.model_dump())
            record_retraction(session, run_id, me.id, str(answer_id), wish, utc_now())
        except ConflictError:
            return _back(run_id)
    return _back(run_id, "undone")


@router.post("/name")
def name(
    request: Request, run_id: str, services: ServicesDep, name: Annotated[PersonName, Form()]
) -> Response:
    """Say by a form who labels in this browser."""
    person: Person = person_of(request)
    with services.database.write() as session:
        name_person(session, person.name, name, rename=not person.named, now=utc_now())
    response = _back(run_id)
    remember(request, response, name)
    return response


def _back(run_id: str, note: str = "") -> RedirectResponse:
    return RedirectResponse(f"/runs/{run_id}/label" + (f"?note={note}" if note else ""), status_code=303)
