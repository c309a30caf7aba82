"""Use cases around a run's life: asked for, claimed, alive, paused, stopped, ended, asked for again.

Every write of a trainer names its claim; once another attempt owns the run, `AttemptLostError` fences the
old one out.
"""

from __future__ import annotations

import secrets
from collections.abc import Collection
from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy import Select, func, select, true
from sqlalchemy.orm import Session

from labels_db.errors import AttemptLostError, ConflictError, NotFoundError
from labels_db.models import ALIVE, Desired, Event, GoalCard, Run, RunState, utc_now
from labels_db.overrides import with_settings
from labels_db.run_config import RunConfig

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
    phase: str
    step: int
    steps_per_second: float | None = None
    wanted_answers: int = 0
    next_session_step: int | None = None
    progress_at: datetime | None = None


def get_run(session: Session, run_id: str) -> Run:
    """The run of that id; NotFoundError when there is none."""
    run = session.get(Run, run_id)
    if run is None:
        raise NotFoundError(f"run {run_id!r}: not in this database; `pebble runs` lists the ones that are")
    return run


def request_run(
    session: Session,
    config: RunConfig,
    *,
    title: str,
    goal: str,
    preset: str | None = None,
    run_id: str | None = None,
    experiment: str | None = None,
    method: str | None = None,
) -> Run:
    """Queue a new run with its first goal card."""
    now = utc_now()
    run = Run(
        id=run_id or f"{preset or 'run'}-{secrets.token_hex(3)}",
        title=title,
        preset=preset,
        experiment=experiment,
        method=method,
        config=config.model_dump(mode="json"),
        queued_at=now,
        created_at=now,
        goal_cards=[GoalCard(version=1, text=goal, created_at=now)],
    )
    session.add(run)
    session.flush()
    note(session, run, "Asked for.")
    return run


def config_of(run: Run) -> RunConfig:
    """What the run was asked to be, with its extensions."""
    return RunConfig.model_validate(run.config)


def note(session: Session, run: Run, text: str) -> None:
    """Keep a sentence in the run's history."""
    session.add(Event(run_id=run.id, attempt=run.attempt, at=utc_now(), text=text))


# Claims ------------------------------------------------------------------------------------------


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
    _expect(run, "start", RunState.QUEUED)
    run.state = RunState.STARTING
    run.owner = owner
    run.attempt += 1
    run.fruitless_attempts += 1
    run.heartbeat_at = now
    run.progress_at = now
    run.ended_at = None
    run.error = None
    run.phase = "starting"
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
    return run.desired


def interrupt_stale(session: Session, *, now: datetime, living: Collection[str] = ()) -> list[str]:
    """Requeue runs whose trainer died without a word; fail those that keep dying without progress.

    Runs whose process is known to be `living` get longer: the machine may just have slept.
    """
    silent = select(Run).where(Run.state.in_(ALIVE), Run.heartbeat_at < now - STALE_AFTER)
    stale = [run for run in session.scalars(silent) if _is_stale(run, now, run.id in living)]
    return [interrupt_run(session, run, "The trainer stopped answering.") for run in stale]


def _is_stale(run: Run, now: datetime, living: bool) -> bool:
    """A starting trainer beats only once its libraries are loaded, which takes a slow disk a while."""
    patience = HUNG_AFTER if living or run.state is RunState.STARTING else STALE_AFTER
    return run.heartbeat_at is not None and run.heartbeat_at < now - patience


def interrupt_run(session: Session, run: Run, reason: str) -> str:
    """An attempt ended without finishing: queue the run again, or fail it after too many without progress."""
    run.state = RunState.INTERRUPTED
    note(session, run, reason)
    if run.desired is Desired.STOP:
        _end(session, run, RunState.STOPPED, f"Stopped at step {run.step}.")
    elif run.fruitless_attempts >= MAX_FRUITLESS_ATTEMPTS:
        error = f"{run.fruitless_attempts} attempts in a row made no progress. {reason}"
        _end(session, run, RunState.FAILED, error, error=error)
    else:
        _requeue(run)
    return run.id


def made_progress(session: Session, claim: Claim) -> None:
    """A checkpoint was written: the next interruption starts counting anew."""
    owned_run(session, claim).fruitless_attempts = 0


# What people want --------------------------------------------------------------------------------


def pause_run(session: Session, run_id: str) -> Run:
    """Ask for a pause; one already asked to stop stops."""
    run = _expect_going(_expect(get_run(session, run_id), "pause", *ALIVE), "pause")
    run.desired = Desired.PAUSE
    note(session, run, "Pause asked for.")
    return run


def resume_run(session: Session, run_id: str) -> Run:
    """Go on: at once when paused, from the last checkpoint when stopped, failed or interrupted."""
    run = _expect_going(get_run(session, run_id), "resume")
    if run.desired is Desired.PAUSE:
        run.desired = Desired.RUN
    elif run.state is not RunState.PAUSED:  # a paused one has been asked already and is about to go on
        _expect(run, "resume", RunState.STOPPED, RunState.FAILED, RunState.INTERRUPTED)
        _requeue(run)
        run.fruitless_attempts = 0
    note(session, run, "Resume asked for.")
    return run


def _expect_going(run: Run, action: str) -> Run:
    if run.desired is Desired.STOP:
        raise ConflictError(f"run {run.id}: cannot {action} while stopping; resume it once it has stopped")
    return run


def stop_run(session: Session, run_id: str) -> Run:
    """Stop with a checkpoint; a queued run stops at once."""
    run = _expect(get_run(session, run_id), "stop", RunState.QUEUED, RunState.INTERRUPTED, *ALIVE)
    run.desired = Desired.STOP
    if run.state not in ALIVE:
        _end(session, run, RunState.STOPPED, "Stopped before it started.")
    else:
        note(session, run, "Stop asked for.")
    return run


def extend_run(session: Session, run_id: str, *, total_steps: int | None, budget: int | None) -> Run:
    """Give a run more steps or more answers; a finished one is queued again."""
    run = get_run(session, run_id)
    before = config_of(run)
    config = _larger(before, total_steps, budget)
    run.config = config.model_dump(mode="json")
    note(session, run, f"Extended to {config.total_steps} steps and {config.budget} answers.")
    if run.state is RunState.FINISHED:
        _requeue(run)
    return run


def _larger(config: RunConfig, total_steps: int | None, budget: int | None) -> RunConfig:
    changes = {}
    for path, now, asked in (
        ("total_steps", config.total_steps, total_steps),
        ("feedback.budget", config.budget, budget),
    ):
        if asked is not None and asked < now:
            raise ConflictError(f"{path} {asked}: a run can only be extended; it already has {now}")
        if asked is not None:
            changes[path] = str(asked)
    return with_settings(config, changes)


# Ends --------------------------------------------------------------------------------------------


def finish_run(session: Session, claim: Claim) -> None:
    """The trainer has done all it was asked."""
    run = owned_run(session, claim)
    _end(session, run, RunState.FINISHED, f"Finished at step {run.step}.")


def acknowledge_stop(session: Session, claim: Claim) -> None:
    """The trainer has stopped, its checkpoint written."""
    run = owned_run(session, claim)
    _end(session, run, RunState.STOPPED, f"Stopped at step {run.step}. Resume continues from there.")


def yield_run(session: Session, claim: Claim) -> None:
    """The trainer was told to go (shutdown): its checkpoint is written, the run waits for its next turn."""
    made_progress(session, claim)
    interrupt_run(session, owned_run(session, claim), "The trainer was shut down.")


def fail_run(session: Session, claim: Claim, error: str) -> None:
    """The trainer cannot go on; `error` says why."""
    run = owned_run(session, claim)
    _end(session, run, RunState.FAILED, "Failed.", error=error)


def _end(session: Session, run: Run, state: RunState, text: str, *, error: str | None = None) -> None:
    _leave(run, state, error)
    run.desired = Desired.RUN
    run.ended_at = utc_now()
    note(session, run, text)


def _requeue(run: Run) -> None:
    """Wait for the next turn; a pause asked for stays asked for."""
    _leave(run, RunState.QUEUED, None)
    run.queued_at = utc_now()


def _leave(run: Run, state: RunState, error: str | None) -> None:
    """No trainer owns the run any more; what the last one said of itself was about then."""
    run.state, run.error = state, error
    run.owner, run.phase, run.steps_per_second, run.wanted_answers = None, "", None, 0


def _expect(run: Run, action: str, *states: RunState) -> Run:
    if run.state not in states:
        allowed = ", ".join(states)
        raise ConflictError(f"run {run.id}: cannot {action} while {run.state}; only when {allowed}")
    return run


def attempt_died(session: Session, claim: Claim, reason: str) -> None:
    """The attempt's process is gone: unless it had given the run up itself, somebody else must go on."""
    run = get_run(session, claim.run_id)
    if run.attempt == claim.attempt and run.state in ALIVE:
        interrupt_run(session, run, reason)
