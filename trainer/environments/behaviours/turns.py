"""Whether the walker's feet take turns."""

from __future__ import annotations

from typing import Any

from trainer.environments.behaviours.shapes import clearances, ramp, rows_of
from trainer.environments.behaviours.wish import Measures, Memory

FEET = ("right_foot", "left_foot")
AHEAD = 0.1  # metres from centre to centre: half a foot
TOUCHING = 0.01  # metres


class TakingTurns:
    """How well two feet take turns in leading the way, over an episode.

    A foot takes the lead when it stands on the floor at least 0.1 m ahead (along +x) of the other. What counts is the
    time since the lead last changed: up to 0.6 s the feet take turns fully, from 1.2 s on not at all, and never
    with the torso below 0.9 m. `alternation` is the mean of this over the states seen, in [0, 1]. A shuffle behind
    one leading leg, standing, hopping and lying have none; a walk at 1 m/s with steps of half a metre has 1.
    All times are the simulator's, so it can also watch an episode's stored states.
    """

    def begin(self, physics: Any) -> None:
        del physics
        self._lead: int | None = None
        self._changed: float | None = None
        self._total, self._seen = 0.0, 0

    def watch(self, physics: Any) -> float:
        """The next state; how well the feet take turns in it, in [0, 1]."""
        time = float(physics.time())
        lead = self._leading(physics)
        if lead is not None and lead != self._lead:
            self._changed = None if self._lead is None else time
            self._lead = lead
        turns = self._fresh(time) * (float(physics.torso_height()) > 0.9)
        self._total, self._seen = self._total + turns, self._seen + 1
        return turns

    def measures(self) -> Measures:
        return {"alternation": self._total / max(self._seen, 1)}

    def state(self) -> Memory:
        return {"lead": self._lead, "changed": self._changed, "total": self._total, "seen": self._seen}

    def load(self, memory: Memory) -> None:
        self._lead, self._changed = memory["lead"], memory["changed"]
        self._total, self._seen = memory["total"], memory["seen"]

    def _fresh(self, time: float) -> float:
        return 0.0 if self._changed is None else 1 - ramp(time - self._changed, 0.6, 1.2)

    def _leading(self, physics: Any) -> int | None:
        right, left = physics.data.geom_xpos[rows_of(physics, FEET), 0]
        ahead = 0 if right > left else 1
        if abs(right - left) < AHEAD or clearances(physics, FEET)[ahead] > TOUCHING:
            return None
        return ahead
