"""What a run is doing, in one sentence for people."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from datetime import datetime

from labels_db.claims import is_silent
from labels_db.history import OpenQuery
from labels_db.models import ALIVE, Desired, Phase, RunState
from labels_db.numbers import number
from labels_db.overview import RunOverview
from server.words import duration, plural

PLACES = ("Next", "Second", "Third", "Fourth", "Fifth", "Sixth", "Seventh", "Eighth", "Ninth", "Tenth")


def state_sentence(seen: RunOverview, now: datetime) -> str:
    """Where the run is, what it waits for, and what happens next."""
    run = seen.run
    if is_silent(run, now) and run.heartbeat_at is not None:
        silence = duration((now - run.heartbeat_at).total_seconds())
        return f"No sign of life for {silence}. It will be queued again by itself."
    if run.state in ALIVE and run.desired is Desired.STOP:
        return f"Stopping at step {number(run.step)}, with a checkpoint."
    if run.state in ALIVE and run.state is not RunState.PAUSED and run.desired is Desired.PAUSE:
        return f"Pausing at step {number(run.step)}."
    return _STATES[run.state](seen)


def _queued(seen: RunOverview) -> str:
    place = seen.queue_position or 1
    return f"{PLACES[place - 1] if place <= len(PLACES) else f'Number {place}'} in the queue."


def _running(seen: RunOverview) -> str:
    return PHASES.get(seen.run.phase, _training)(seen)


def _waiting(seen: RunOverview) -> str:
    wanted = seen.run.wanted_answers
    if wanted:
        return f"Waiting for {plural(wanted, 'answer')}."
    return "Drawing the next pairs." if seen.feedback.rendering else "Waiting for answers."


def _exploring(seen: RunOverview) -> str:
    return f"Exploring without reward: {_progress(seen)}{_next(seen)}."


def _training(seen: RunOverview) -> str:
    return f"Training: {_progress(seen)}{_next(seen)}."


def _fitting(seen: RunOverview) -> str:
    return f"Learning the reward from {plural(seen.feedback.preferences, 'answer')}."


def _stopped(seen: RunOverview) -> str:
    if seen.run.step == 0:
        return "Stopped before its first step. Resume queues it again."
    return f"Stopped at step {number(seen.run.step)}. Resume continues from there."


def _at(text: str) -> Callable[[RunOverview], str]:
    return lambda seen: text.format(step=number(seen.run.step), progress=_progress(seen))


def _progress(seen: RunOverview) -> str:
    return f"step {number(seen.run.step)} of {number(seen.config.total_steps)}"


def _next(seen: RunOverview) -> str:
    """When something happens that a person may wait for, as far as the present speed can tell."""
    run, speed = seen.run, seen.run.steps_per_second
    if not speed:
        return ""
    if run.next_session_step and run.next_session_step > run.step and seen.feedback.remaining:
        which = "next" if seen.feedback.posted else "first"
        return f", {which} pairs in about {duration((run.next_session_step - run.step) / speed)}"
    left = seen.config.total_steps - run.step
    return f", about {duration(left / speed)} left" if left > 0 else ""


_starting = _at("Starting.")
_paused = _at("Paused at step {step}. Answers still count.")

PHASES: Mapping[str, Callable[[RunOverview], str]] = {
    Phase.STARTING: _starting,
    Phase.SEEDING: _at("Moving at random: {progress}."),
    Phase.EXPLORING: _exploring,
    Phase.ASKING: _at("Choosing pairs to ask about."),
    Phase.WAITING: _waiting,
    Phase.FITTING: _fitting,
    Phase.RELABELLING: _at("Giving everything it has lived through the new reward."),
    Phase.TRAINING: _training,
    Phase.EVALUATING: _at("Trying its policy out at step {step}."),
    Phase.CHECKPOINTING: _at("Saving a checkpoint at step {step}."),
    Phase.PAUSED: _paused,
}
"""What a running trainer does; one newer than this server may say something else, and trains."""

_STATES: Mapping[RunState, Callable[[RunOverview], str]] = {
    RunState.QUEUED: _queued,
    RunState.STARTING: _starting,
    RunState.RUNNING: _running,
    RunState.WAITING: _waiting,
    RunState.PAUSED: _paused,
    RunState.FINISHED: _at("Finished at step {step}."),
    RunState.FAILED: _at("Failed at step {step}. Resume tries again from the last checkpoint."),
    RunState.STOPPED: _stopped,
}


def queue_sentence(waiting: Sequence[OpenQuery]) -> str:
    """How many pairs wait, and how many of them somebody is looking at."""
    if not waiting:
        return "No pair waits for an answer."
    looked_at = sum(1 for each in waiting if each.leased)
    lent = f", {number(looked_at)} of them on somebody's screen" if looked_at else ""
    return f"{plural(len(waiting), 'pair')} {'waits' if len(waiting) == 1 else 'wait'} for an answer{lent}."
