"""When feedback sessions open, of how many queries, and what training does until they are answered."""

from __future__ import annotations

from collections.abc import Callable
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol

from labels_db.feedback_progress import Inbox
from labels_db.run_config import Asking, Continuous, Sessions
from trainer.asking import Asker

if TYPE_CHECKING:
    from trainer.training import Training


class Rule(Protocol):
    def ask(self, asker: Asker, training: Training, inbox: Inbox) -> None:
        """Open a session if one is due."""


Pace = Callable[[Asker, "Training"], Inbox]
"""Waits for answers if they are to be waited for; what has been asked and answered by then."""

SCHEDULES: dict[str, Callable[[int, int, int], int]] = {
    "constant": lambda first, _step, _total: first,
    "decreasing": lambda first, step, total: first * (total - step) // total,
    "increasing": lambda first, step, total: first * total // (total - step + 1),
}
"""M, rounded down, from its first value, at a step of the run's total (algorithm, section 5)."""


class EveryKSteps:
    """Sessions of M queries, K steps apart; what is open by then is superseded.

    Not so once the sessions left could not hold what the budget still wants: then training waits for the
    answers, so that a slow person on a fast machine is still asked everything.
    """

    def __init__(self, config: Sessions, last_step: int) -> None:
        self.config = config
        self.last_step = last_step

    def ask(self, asker: Asker, training: Training, inbox: Inbox) -> None:
        step = training.step
        if step < asker.so_far.next_step or not asker.can_draw():
            return
        slow = inbox.open and not asker.is_left_open(step) and asker.remaining() > self.capacity(step)
        if slow and asker.wait(training, lambda inbox: inbox.complete).sequence > asker.so_far.cursor:
            return  # what was waited for is learned from first: the loop asks again at this step
        asker.supersede()
        asker.open(training, self.queries(step))
        asker.postpone(step + self.config.steps_between)

    def capacity(self, step: int) -> int:
        """Queries of the sessions from this step to the last."""
        return sum(map(self.queries, range(step, self.last_step, self.config.steps_between)))

    def queries(self, step: int) -> int:
        """M of the session at that step: rounded down, at least 1."""
        wanted = SCHEDULES[self.config.schedule](self.config.queries_per_session, step, self.last_step)
        return max(1, wanted)


class AlwaysReady:
    """A few queries ready at any time; they are replaced when nobody has answered for many steps."""

    LOOK_AGAIN = 100
    """Steps until a spent budget is looked at again: an answer taken back makes room."""

    def __init__(self, config: Continuous) -> None:
        self.config = config

    def ask(self, asker: Asker, training: Training, inbox: Inbox) -> None:
        step, so_far = training.step, asker.so_far
        if step == so_far.opened_step:
            return  # a scripted teacher, who answers at once, would be asked the whole budget at one step
        if step < so_far.next_step:
            return
        missing = self.config.ready - inbox.open - inbox.rendering
        stale = step - max(so_far.opened_step, so_far.news_step) >= self.config.fresh_steps
        due = missing > 0 or stale or asker.is_left_open(step)
        if not due or not asker.can_draw():
            return
        if stale and inbox.open:
            asker.supersede()
            missing = self.config.ready
        self._open(asker, training, missing)

    def _open(self, asker: Asker, training: Training, missing: int) -> None:
        """Seldom again where there is no budget, and more seldom where nothing can be drawn."""
        if not asker.open(training, missing):
            asker.postpone(training.step + self.LOOK_AGAIN)
        elif asker.drew_nothing():
            asker.postpone(training.step + self.config.fresh_steps)


def until_all_answered(asker: Asker, training: Training) -> Inbox:
    """Block, as Algorithm 2 is printed: training stands still until everything asked is answered."""
    return asker.wait(training, lambda inbox: inbox.complete)


def unless_nobody_answers(asker: Asker, training: Training) -> Inbox:
    """Stream: training goes on, but saves its steps when nobody has answered for long."""
    inbox = asker.news(training.step)
    if inbox.open and training.step - asker.so_far.news_step >= asker.config.patience_steps:
        seen = inbox.sequence
        return asker.wait(training, lambda inbox: inbox.sequence != seen or not inbox.open)
    return inbox


PACES: dict[str, Pace] = {
    "block": until_all_answered,
    "stream": unless_nobody_answers,
}


def rule_and_pace(config: Asking, total_steps: int) -> tuple[Rule, Pace]:
    """Those of the configured kind of feedback."""
    return KINDS[type(config)](config, total_steps)


def _sessions(config: Sessions, total_steps: int) -> tuple[Rule, Pace]:
    return EveryKSteps(config, total_steps), PACES[config.pace]


def _continuous(config: Continuous, _total_steps: int) -> tuple[Rule, Pace]:
    return AlwaysReady(config), unless_nobody_answers


KINDS: MappingProxyType[type, Callable[[Any, int], tuple[Rule, Pace]]] = MappingProxyType(
    {Sessions: _sessions, Continuous: _continuous}
)
