"""What trainers do with a run: claim it, be alive in it, end it.

Every write of a trainer names its claim; once another attempt owns the run, `AttemptLostError` fences the
old one out.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy import Select, func, select, true
from sqlalchemy.orm import Session

from labels_db.errors import AttemptLostError
from labels_db.models import ALIVE, Desired, Phase, Run, RunState
from labels_db.numbers import number
from labels_db.runs import config_of, end_run, expect, get_run, note, requeue

STALE_AFTER = timedelta(seconds=30)
"""A heartbeat older than this is a dead trainer's; they beat every 5 s."""

HUNG_AFTER = timedelta(minutes=5)
"""So long a process that lives, or is just starting, may be silent."""

MAX_FRUITLESS_ATTEMPTS = 3


@dataclass(frozen=True)
class Claim:
    """The right of one attempt to write to a run."""

    run_id: str
    attempt: int


@dataclass(frozen=True)
class Report:
    """What a trainer says of itself with every beat."""

    state: RunState
    phase: Phase
    step: int
    steps_per_second: float | None = None
    wanted_answers: int = 0
    next_session_step: int | None = None
    progress_at: datetime | None = None


def claim_run(
    session: Session, owner: str, *, max_parallel: int, now: datetime, experiment: str | None = None
) -> Claim | None:
    """The oldest queued run, owned from now on by a new attempt; None when there is none or no room.

    Of an experiment's runs alone if one is named: others then neither count nor wait.
    """
    ours = true() if experiment is None else Run.experiment == experiment
    alive = session.scalar(select(func.count()).select_from(Run).where(Run.state.in_(ALIVE), ours)) or 0
    run = None if alive >= max_parallel else session.scalar(_queue().where(ours).limit(1))
    return None if run is None else claim(session, run, owner, now=now)


def claim(session: Session, run: Run, owner: str, *, now: datetime) -> Claim:
    """Own that queued run by a new attempt."""
    expect(run, "start", RunState.QUEUED)
    run.state = RunState.STARTING
    run.owner = owner
    run.attempt += 1
    run.fruitless_attempts += 1
    run.heartbeat_at = now
    run.progress_at = now
    run.ended_at = None
    run.error = None
    run.phase = Phase.STARTING
    note(session, run, f"Attempt {run.attempt} starts.")
    return Claim(run.id, run.attempt)


def queue_positions(session: Session) -> dict[str, int]:
    """Place in the queue of every queued run, from 1."""
    waiting = session.scalars(_queue().with_only_columns(Run.id))
    return {run_id: place for place, run_id in enumerate(waiting, start=1)}


def _queue() -> Select[Run]:
    return select(Run).where(Run.state == RunState.QUEUED).order_by(Run.queued_at, Run.id)


def owned_run(session: Session, claim: Claim) -> Run:
    """The claimed run; AttemptLostError when another attempt owns it or it has ended."""
    run = get_run(session, claim.run_id)
    if run.attempt != claim.attempt or run.state not in ALIVE:
        raise AttemptLostError(
            f"run {claim.run_id}: attempt {claim.attempt} lost it (now {run.state}, attempt {run.attempt})"
        )
    return run


def beat(session: Session, claim: Claim, report: Report, *, now: datetime) -> Desired:
    """Record a sign of life and what the trainer is doing; returns what is wanted of it."""
    run = owned_run(session, claim)
    run.state = report.state
    run.phase = report.phase
    run.step = report.step
    run.steps_per_second = report.steps_per_second
    run.wanted_answers = report.wanted_answers
    run.next_session_step = report.next_session_step
    run.heartbeat_at = now
    run.progress_at = report.progress_at or run.progress_at
    if report.state is RunState.WAITING and run.progress_at and now - run.progress_at > STALE_AFTER:
        run.fruitless_attempts = 0  # it has waited for a while: nothing but people keeps it from going on
    return run.desired


def interrupt_stale(session: Session, *, now: datetime, living: Collection[str] = ()) -> list[str]:
    """Requeue runs whose trainer died without a word; fail those that keep dying without progress.

    Runs whose process is known to be `living` get longer: the machine may just have slept.
    """
    silent = select(Run).where(Run.state.in_(ALIVE), Run.heartbeat_at < now - STALE_AFTER)
    stale = [run for run in session.scalars(silent) if is_silent(run, now, living=run.id in living)]
    return [interrupt_run(session, run, "The trainer stopped answering.") for run in stale]


def is_silent(run: Run, now: datetime, *, living: bool = False) -> bool:
    """Whether a trainer should be answering but is not; a starting one first loads its libraries, at times slowly."""
    patience = HUNG_AFTER if living or run.state is RunState.STARTING else STALE_AFTER
    return run.state in ALIVE and run.heartbeat_at is not None and run.heartbeat_at < now - patience


def interrupt_run(session: Session, run: Run, reason: str) -> str:
    """An attempt ended without finishing: queue the run again, or fail it after too many without progress."""
    note(session, run, reason)
    if run.desired is Desired.STOP:
        end_run(session, run, RunState.STOPPED, f"Stopped at step {number(run.step)}.")
    elif run.fruitless_attempts >= MAX_FRUITLESS_ATTEMPTS:
        error = f"{run.fruitless_attempts} attempts in a row made no progress. {reason}"
        end_run(session, run, RunState.FAILED, error, error=error)
    else:
        requeue(run)
    return run.id


def made_progress(session: Session, claim: Claim) -> None:
    """It has come farther than any attempt before: the next interruption starts counting anew."""
    owned_run(session, claim).fruitless_attempts = 0


# Ends ------------------------------------------------------------------------------------------


def finish_or_go_on(session: Session, claim: Claim, *, total_steps: int) -> RunState:
    """So many steps have been lived through: the run is finished, or queued for more if it was extended meanwhile."""
    run = owned_run(session, claim)
    if config_of(run).total_steps <= total_steps:
        finish_run(session, claim)
    else:
        made_progress(session, claim)
        note(session, run, "Extended while it was ending: it waits for its turn to go on.")
        requeue(run)
    return run.state


def finish_run(session: Session, claim: Claim) -> None:
    """The trainer has done all it was asked."""
    run = owned_run(session, claim)
    end_run(session, run, RunState.FINISHED, f"Finished at step {number(run.step)}.")


def acknowledge_stop(session: Session, claim: Claim) -> None:
    """The trainer has stopped, its checkpoint written."""
    run = owned_run(session, claim)
    end_run(
        session, run, RunState.STOPPED, f"Stopped at step {number(run.step)}. Resume continues from there."
    )


def yield_run(session: Session, claim: Claim) -> None:
    """The trainer was told to go (shutdown): its checkpoint is written, the run waits for its next turn."""
    made_progress(session, claim)
    interrupt_run(session, owned_run(session, claim), "The trainer was shut down.")


def fail_run(session: Session, claim: Claim, error: str) -> None:
    """The trainer cannot go on; `error` says why."""
    run = owned_run(session, claim)
    end_run(session, run, RunState.FAILED, "Failed.", error=error)


def attempt_died(session: Session, claim: Claim, reason: str) -> None:
    """The attempt's process is gone: unless it had given the run up itself, somebody else must go on."""
    run = get_run(session, claim.run_id)
    if run.attempt == claim.attempt and run.state in ALIVE:
        interrupt_run(session, run, reason)
