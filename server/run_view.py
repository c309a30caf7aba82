"""A run as pages and the API show it: its record, put into words, and what can be done with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Literal

from labels_db.claims import is_silent
from labels_db.models import ALIVE, ENDED, Desired, Run, RunState
from labels_db.overview import RunOverview
from server.sentences import state_sentence

Action = Literal["pause", "resume", "stop", "extend"]
Tone = Literal["going", "wanting", "resting", "done", "wrong"]


@dataclass(frozen=True)
class RunView:
    """What a page needs of one run."""

    seen: RunOverview
    sentence: str
    tone: Tone
    actions: frozenset[Action]
    primary: Literal["label", "resume", "watch"]
    silent: bool

    @property
    def run(self) -> Run:
        return self.seen.run

    @property
    def last_return(self) -> float | None:
        return self.seen.last_return

    @property
    def sparkline(self) -> str:
        return sparkline(self.seen.returns)


def view(seen: RunOverview, now: datetime) -> RunView:
    """The run in words."""
    return RunView(
        seen=seen,
        sentence=state_sentence(seen, now),
        tone=_tone(seen.run, now),
        actions=actions_of(seen.run),
        primary=_primary(seen),
        silent=is_silent(seen.run, now),
    )


def actions_of(run: Run) -> frozenset[Action]:
    """What may be asked of the run now, as `labels_db.runs` will allow it."""
    stopping = run.desired is Desired.STOP
    possible: dict[Action, bool] = {
        "pause": run.state in ALIVE and run.desired is Desired.RUN,
        "resume": run.desired is Desired.PAUSE or run.state in (RunState.STOPPED, RunState.FAILED),
        "stop": not stopping and run.state not in ENDED,
        "extend": not stopping,
    }
    return frozenset(action for action, holds in possible.items() if holds)


def _primary(seen: RunOverview) -> Literal["label", "resume", "watch"]:
    """The one thing a person most likely came for."""
    if "resume" in actions_of(seen.run):
        return "resume"
    comes = seen.run.state not in ENDED and seen.feedback.remaining
    if seen.config.asks_people and (seen.feedback.open or comes):
        return "label"
    return "watch"


def _tone(run: Run, now: datetime) -> Tone:
    if run.state is RunState.FAILED or is_silent(run, now):
        return "wrong"
    if run.state is RunState.WAITING and run.wanted_answers:
        return "wanting"
    if run.state is RunState.FINISHED:
        return "done"
    return "going" if run.state in ALIVE and run.state is not RunState.PAUSED else "resting"


def sparkline(points: Sequence[tuple[int, float]], width: int = 100, height: int = 28) -> str:
    """The points of an SVG polyline that fills the box but for a pixel; "" for fewer than two."""
    if len(points) < 2:
        return ""
    first, last = points[0][0], points[-1][0]
    low, high = min(y for _, y in points), max(y for _, y in points)
    return " ".join(
        f"{width * (x - first) / (last - first):.1f},{_scaled(y, low, high, height):.1f}" for x, y in points
    )


def _scaled(value: float, low: float, high: float, height: int) -> float:
    """From the bottom up, as pixels from the top; a flat line lies in the middle."""
    return height / 2 if high == low else 1 + (height - 2) * (high - value) / (high - low)
