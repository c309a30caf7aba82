"""What people do with a run: ask for it, pause, resume, stop and extend it; and how it comes to an end."""

from __future__ import annotations

import re
import secrets

from sqlalchemy.orm import Session

from labels_db.errors import ConflictError, NotFoundError
from labels_db.models import ALIVE, Desired, Event, GoalCard, Run, RunState, utc_now
from labels_db.numbers import number
from labels_db.overrides import with_settings
from labels_db.run_config import RECORDED, RunConfig


def get_run(session: Session, run_id: str) -> Run:
    """The run of that id; NotFoundError when there is none."""
    run = session.get(Run, run_id)
    if run is None:
        raise NotFoundError(
            f"run {run_id!r}: not in this database; `pebble runs` lists the ones that are", field="run_id"
        )
    return run


def id_part(name: str) -> str:
    """A preset's name as part of a run's id, which is one part of addresses and of files' names."""
    return re.sub(r"[^A-Za-z0-9._-]+", "-", name)


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
        id=run_id or f"{id_part(preset or 'run')}-{secrets.token_hex(3)}",
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
    """What the run was asked to be, with its extensions, whether or not its environment is still known."""
    return RunConfig.model_validate(run.config, context=RECORDED)


def note(session: Session, run: Run, text: str) -> None:
    """Keep a sentence in the run's history."""
    session.add(Event(run_id=run.id, attempt=run.attempt, at=utc_now(), text=text))


# What people want --------------------------------------------------------------------------------


def pause_run(session: Session, run_id: str) -> Run:
    """Ask for a pause; one already asked to stop stops."""
    run = _expect_going(expect(get_run(session, run_id), "pause", *ALIVE), "pause")
    run.desired = Desired.PAUSE
    note(session, run, "Pause asked for.")
    return run


def resume_run(session: Session, run_id: str) -> Run:
    """Go on: at once when paused, from the last checkpoint when stopped or failed."""
    run = _expect_going(get_run(session, run_id), "resume")
    if run.desired is Desired.PAUSE:
        run.desired = Desired.RUN
    elif run.state is not RunState.PAUSED:  # a paused one has been asked already and is about to go on
        expect(run, "resume", RunState.STOPPED, RunState.FAILED)
        requeue(run)
        run.fruitless_attempts = 0
    note(session, run, "Resume asked for.")
    return run


def _expect_going(run: Run, action: str) -> Run:
    if run.desired is Desired.STOP:
        raise ConflictError(f"run {run.id}: cannot {action} while stopping; resume it once it has stopped")
    return run


def stop_run(session: Session, run_id: str) -> Run:
    """Stop with a checkpoint; a queued run stops at once."""
    run = expect(get_run(session, run_id), "stop", RunState.QUEUED, *ALIVE)
    run.desired = Desired.STOP
    if run.state not in ALIVE:
        end_run(session, run, RunState.STOPPED, "Stopped before it started.")
    else:
        note(session, run, "Stop asked for.")
    return run


def extend_run(session: Session, run_id: str, *, total_steps: int | None, budget: int | None) -> Run:
    """Give a run more steps or more answers; a finished one needs steps to use them, and is queued again."""
    run = get_run(session, run_id)
    config = _larger(config_of(run), total_steps, budget)
    if run.state is RunState.FINISHED and config.total_steps <= run.step:
        raise ConflictError(
            f"total_steps {config.total_steps}: the run has used them up; more answers need more steps to ask in"
        )
    run.config = config.model_dump(mode="json")
    note(session, run, f"Extended to {number(config.total_steps)} steps and {number(config.budget)} answers.")
    if run.state is RunState.FINISHED:
        requeue(run)
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


# States ------------------------------------------------------------------------------------------


def end_run(session: Session, run: Run, state: RunState, text: str, *, error: str | None = None) -> None:
    """Nothing more happens in it until somebody asks; the text goes into its history."""
    _leave(run, state, error)
    run.desired = Desired.RUN
    run.ended_at = utc_now()
    note(session, run, text)


def requeue(run: Run) -> None:
    """Wait for the next turn; a pause asked for stays asked for."""
    _leave(run, RunState.QUEUED, None)
    run.queued_at = utc_now()


def _leave(run: Run, state: RunState, error: str | None) -> None:
    """No trainer owns the run any more; what the last one said of itself was about then."""
    run.state, run.error = state, error
    run.owner, run.phase, run.steps_per_second, run.wanted_answers = None, "", None, 0


def expect(run: Run, action: str, *states: RunState) -> Run:
    """The run, if it is in one of these states; ConflictError names the action and the states."""
    if run.state not in states:
        allowed = ", ".join(states)
        raise ConflictError(f"run {run.id}: cannot {action} while {run.state}; only when {allowed}")
    return run
