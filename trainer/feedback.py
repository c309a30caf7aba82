"""Feedback: when queries are asked, and when answers are learned from (Algorithm 2, lines 7–17).

Before every step the loop asks its feedback one question: is there something to learn from now, and if so,
up to which answer? Runs that block, stream or never ask differ only here.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Protocol

from trainer.asking import Asker
from trainer.asking_rules import Pace, Rule

if TYPE_CHECKING:
    from trainer.training import Training


class Feedback(Protocol):
    """What the training loop asks before every step."""

    def before_step(self, training: Training) -> int | None:
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

    def before_step(self, training: Training) -> int | None:
        return self.fits.popleft()[1] if self.fits and self.fits[0][0] == training.step else None

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


class FromTeacher:
    """Feedback from a teacher: a rule that asks, and a pace at which training goes on meanwhile."""

    def __init__(self, asker: Asker, rule: Rule, pace: Pace, total_steps: int) -> None:
        self.asker = asker
        self.rule = rule
        self.pace = pace
        self.total_steps = total_steps

    def before_step(self, training: Training) -> int | None:
        self.rule.ask(self.asker, training, self.asker.news(training.step))
        inbox = self.pace(self.asker, training)
        new = inbox.sequence - self.asker.so_far.cursor
        enough = new >= self.asker.config.fit_every or (new > 0 and inbox.complete)
        return inbox.sequence if enough else None

    def learned(self, cursor: int) -> None:
        self.asker.learned(cursor)

    def cursor(self) -> int:
        return self.asker.so_far.cursor

    def next_session_step(self) -> int | None:
        following = self.asker.so_far.next_step
        return following if following < self.total_steps else None

    def state(self) -> dict[str, Any]:
        return self.asker.state()

    def load(self, state: dict[str, Any]) -> None:
        self.asker.load(state)

    def close(self) -> None:
        self.asker.desk.close()
