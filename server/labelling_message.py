"""Why there is no pair just now, in a sentence that says what happens next."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import datetime

from labels_db.claims import is_silent
from labels_db.labelling import Queue
from labels_db.models import Desired, Phase, RunState
from labels_db.numbers import number
from server.labelling_models import MessageKind, MessageOut
from server.words import duration, plural

Reason = Callable[[Queue, datetime], MessageOut | None]

KEPT = "Your answers are kept."
BY_ITSELF = "This page goes on by itself."
OVER: frozenset[MessageKind] = frozenset(
    {"archived", "scripted", "finished", "failed", "stopped", "answered"}
)
"""Reasons after which no more pairs come, unless somebody asks more of the run."""


def empty_message(queue: Queue, now: datetime) -> MessageOut:
    """The first reason that applies; training goes on where none of the others does."""
    reasons: tuple[Reason, ...] = (
        _over,
        _all_answered,
        _not_begun,
        _held_up,
        _on_their_way,
        _no_more_sessions,
    )
    found = (reason(queue, now) for reason in reasons)
    return next((message for message in found if message), None) or _training(queue, now)


def _say(kind: MessageKind, *sentences: str, seconds: float | None = None) -> MessageOut:
    sentence = " ".join(filter(None, sentences))
    return MessageOut(kind=kind, sentence=sentence, over=kind in OVER, seconds=seconds)


def _over(queue: Queue, _now: datetime) -> MessageOut | None:
    """Nothing will come, whatever was answered."""
    step, state = number(queue.run.step), queue.run.state
    if queue.run.archived:
        return _say("archived", "This run is archived: its queries can no longer be answered.")
    if not queue.asks_people:
        return _say("scripted", "Nobody needs to answer here: this run has a scripted teacher or none.")
    if state is RunState.FINISHED:
        return _say("finished", f"The training is finished, after {step} steps.", _given(queue))
    if state is RunState.FAILED:
        return _say("failed", f"The training broke off at step {step}; the run's page says why.", KEPT)
    if state is RunState.STOPPED:
        return _say("stopped", f"Stopped at step {step}. Resume continues from there.", KEPT)
    return None


def _given(queue: Queue) -> str:
    given, budget = queue.progress.given, queue.progress.budget
    return "" if given >= budget else f"It learned from {given} of {budget} answers."


def _all_answered(queue: Queue, now: datetime) -> MessageOut | None:
    if queue.progress.remaining:
        return None
    thanks = f"All {queue.progress.budget} answers are given. Thank you."
    if _not_begun(queue, now) or _held_up(queue, now):
        return _say("answered", thanks, "The agent trains with them once the run goes on.")
    return _say("answered", thanks, f"The agent goes on training with them, {_how_long(queue, now)}.")


def _how_long(queue: Queue, now: datetime) -> str:
    left = _seconds_to(queue, queue.total_steps, now)
    return f"about {_span(left)} more" if left is not None else "for a while"


def _not_begun(queue: Queue, _now: datetime) -> MessageOut | None:
    state = queue.run.state
    if state is RunState.QUEUED:
        ahead = (queue.place or 1) - 1
        where = (
            f"This run waits behind {plural(ahead, 'other run')}."
            if ahead
            else "This run is the next to start."
        )
        return _say("queued", where, "Pairs come a while after it has started.")
    if state is RunState.STARTING:
        return _say("starting", "The run is starting. The first pairs come once the robot has moved a while.")
    return None


def _held_up(queue: Queue, now: datetime) -> MessageOut | None:
    run = queue.run
    if run.state is RunState.PAUSED or run.desired is Desired.PAUSE:
        return _say("paused", f"Paused at step {number(run.step)}. Pairs come again once the run is resumed.")
    if run.desired is Desired.STOP:
        return _say("stopped", f"The run is stopping at step {number(run.step)}.", KEPT)
    if is_silent(run, now) and run.heartbeat_at is not None:
        silence = duration((now - run.heartbeat_at).total_seconds())
        return _say("silent", f"The trainer has been silent for {silence}; it will be started again.", KEPT)
    return None


def _on_their_way(queue: Queue, _now: datetime) -> MessageOut | None:
    progress, run = queue.progress, queue.run
    if progress.rendering:
        coming = plural(progress.rendering, "pair") + (" is" if progress.rendering == 1 else " are")
        return _say("rendering", f"{coming} being drawn: the first is ready in a moment.")
    if progress.open:
        left = "The last pair is" if progress.open == 1 else f"The {progress.open} pairs that are left are"
        return _say("others", f"{left} with other labellers just now.", BY_ITSELF)
    if run.state is RunState.WAITING:
        wanted = plural(run.wanted_answers, "answer")
        return _say("waiting", f"The agent waits for {wanted}: the next pairs are on their way.")
    return None


def _no_more_sessions(queue: Queue, now: datetime) -> MessageOut | None:
    """The last session was answered in part, or with 'cannot tell': the budget is not met and never will be.

    A run with steps enough for another session has been extended: its trainer will come to that.
    """
    extended = queue.total_steps - queue.run.step > queue.steps_between
    if queue.run.next_session_step is not None or extended:
        return None
    given, budget = queue.progress.given, queue.progress.budget
    learns = f"No more pairs come: the run learns from {given} of {budget} answers."
    return _say("answered", learns, f"The agent goes on training, {_how_long(queue, now)}.")


DOING: Mapping[str, str] = {
    Phase.STARTING: "training",
    Phase.SEEDING: "trying things out",
    Phase.EXPLORING: "trying things out",
    Phase.ASKING: "training",
    Phase.WAITING: "training",
    Phase.FITTING: "learning from your answers",
    Phase.RELABELLING: "learning from your answers",
    Phase.TRAINING: "training",
    Phase.EVALUATING: "training",
    Phase.CHECKPOINTING: "training",
    Phase.PAUSED: "training",
}


def _training(queue: Queue, now: datetime) -> MessageOut:
    doing = f"The agent is {DOING.get(queue.run.phase, 'training')}"
    left = _seconds_to(queue, queue.run.next_session_step, now)
    if left is None:
        return _say("training", f"{doing}: the next pairs come in a while.", BY_ITSELF)
    when = f"in about {_span(left)}" if left >= 1 else "any moment now"
    return _say("training", f"{doing}: next pairs {when}.", seconds=left)


def _seconds_to(queue: Queue, step: int | None, now: datetime) -> float | None:
    """Seconds until the run reaches that step at its present pace, counted on since its last heartbeat."""
    run = queue.run
    if step is None or not run.steps_per_second or run.heartbeat_at is None:
        return None
    since = (now - run.heartbeat_at).total_seconds()
    return max(0.0, (step - run.step) / run.steps_per_second - since)


def _span(seconds: float) -> str:
    return duration(max(1.0, seconds))
