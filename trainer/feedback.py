"""Feedback: when queries are asked, and when answers are learned from (Algorithm 2, lines 7–17).

Before every step the loop asks its feedback one question: is there something to learn from now, and if so,
up to which answer? Runs that block, stream or never ask differ only here.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from typing import Any, Protocol

from labels_db.feedback_progress import Inbox
from labels_db.run_config import Continuous, RunConfig, Sessions
from trainer.asking import Asker


class Feedback(Protocol):
    """What the training loop asks before every step."""

    def before_step(self, step: int) -> int | None:
        """Ask what is due; the answer cursor to learn up to, or None while there is nothing new."""

    def learned(self, cursor: int) -> None:
        """The answers up to the cursor have been learned from."""

    def cursor(self) -> int:
        """The last answer learned from."""

    def next_session_step(self) -> int | None:
        """When the next session opens, if that is known."""

    def state(self) -> dict[str, Any]:
        """How far asking has come."""

    def load(self, state: dict[str, Any]) -> None:
        """Go on from there."""

    def close(self) -> None:
        """Post nothing more."""


class RecordedFits:
    """The fits of an earlier run, at the same steps with the same answers; by default none at all."""

    def __init__(self, fits: Iterable[tuple[int, int]] = ()) -> None:
        """`fits` are (step, cursor) in order."""
        self.fits = deque(fits)

    def before_step(self, step: int) -> int | None:
        return self.fits.popleft()[1] if self.fits and self.fits[0][0] == step else None

    def learned(self, cursor: int) -> None:
        """The record knows already."""

    def cursor(self) -> int:
        return 0

    def next_session_step(self) -> int | None:
        return None

    def state(self) -> dict[str, Any]:
        return {}

    def load(self, state: dict[str, Any]) -> None:
        """Nothing is remembered between steps."""

    def close(self) -> None:
        """Nothing was posted."""


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

    def ask(self, asker: Asker, step: int, inbox: Inbox) -> None:
        if step < asker.where.next_step or not asker.can_draw():
            return
        slow = inbox.open and not asker.is_left_open(step) and asker.remaining() > self.capacity(step)
        if slow and asker.wait(step, lambda inbox: inbox.complete).sequence > asker.where.cursor:
            return  # what was waited for is learned from first: the loop asks again at this step
        asker.supersede()
        asker.open(step, self.queries(step))
        asker.where.next_step = step + self.config.steps_between

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

    def ask(self, asker: Asker, step: int, inbox: Inbox) -> None:
        if step == asker.where.opened_step:
            return  # a scripted teacher, who answers at once, would be asked the whole budget at one step
        if step < asker.where.next_step:
            return
        missing = self.config.ready - inbox.open - inbox.rendering
        stale = step - max(asker.where.opened_step, asker.where.news_step) >= self.config.fresh_steps
        due = missing > 0 or stale or asker.is_left_open(step)
        if not due or not asker.can_draw():
            return
        if stale and inbox.open:
            asker.supersede()
            missing = self.config.ready
        self._open(asker, step, missing)

    def _open(self, asker: Asker, step: int, missing: int) -> None:
        """Seldom again where there is no budget, and more seldom where nothing can be drawn."""
        if not asker.open(step, missing):
            asker.where.next_step = step + self.LOOK_AGAIN
        elif asker.drew_nothing():
            asker.where.next_step = step + self.config.fresh_steps


def until_all_answered(asker: Asker, step: int) -> Inbox:
    """Block, as Algorithm 2 is printed: training stands still until everything asked is answered."""
    return asker.wait(step, lambda inbox: inbox.complete)


def unless_nobody_answers(asker: Asker, step: int) -> Inbox:
    """Stream: training goes on, but saves its steps when nobody has answered for long."""
    inbox = asker.news(step)
    if inbox.open and step - asker.where.news_step >= asker.config.patience_steps:
        seen = inbox.sequence
        return asker.wait(step, lambda inbox: inbox.sequence != seen or not inbox.open)
    return inbox


PACES: dict[str, Callable[[Asker, int], Inbox]] = {
    "block": until_all_answered,
    "stream": unless_nobody_answers,
}


class FromTeacher:
    """Feedback from a teacher: a rule that asks, and a pace at which training goes on meanwhile."""

    def __init__(
        self,
        asker: Asker,
        rule: EveryKSteps | AlwaysReady,
        pace: Callable[[Asker, int], Inbox],
        steps: range,
    ) -> None:
        """`steps` are those of the run after exploration."""
        self.asker = asker
        self.rule = rule
        self.pace = pace
        self.steps = steps
        asker.where.next_step = asker.where.news_step = steps.start

    def before_step(self, step: int) -> int | None:
        self.rule.ask(self.asker, step, self.asker.news(step))
        inbox = self.pace(self.asker, step)
        new = inbox.sequence - self.asker.where.cursor
        enough = new >= self.asker.config.fit_every or (new > 0 and inbox.complete)
        return inbox.sequence if enough else None

    def learned(self, cursor: int) -> None:
        self.asker.where.cursor = cursor

    def cursor(self) -> int:
        return self.asker.where.cursor

    def next_session_step(self) -> int | None:
        following = self.asker.where.next_step
        return following if following < self.steps.stop else None

    def state(self) -> dict[str, Any]:
        return self.asker.state()

    def load(self, state: dict[str, Any]) -> None:
        self.asker.load(state)

    def close(self) -> None:
        self.asker.desk.close()


def make_feedback(asker: Asker, run: RunConfig) -> FromTeacher:
    """The configured rule and pace."""
    config, steps = asker.config, range(run.exploration.ends_at, run.total_steps)
    if isinstance(config, Continuous):
        return FromTeacher(asker, AlwaysReady(config), unless_nobody_answers, steps)
    assert isinstance(config, Sessions)
    return FromTeacher(asker, EveryKSteps(config, run.total_steps), PACES[config.pace], steps)
