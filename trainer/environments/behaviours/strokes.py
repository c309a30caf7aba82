"""Counting strokes up and down."""

from __future__ import annotations

from trainer.environments.behaviours.wish import Memory

LEAST = 0.1  # metres up, and down again


class Strokes:
    """Counts how often a height rose by `LEAST` and fell by `LEAST` again without a break."""

    def __init__(self) -> None:
        self.count = 0
        self.break_off()

    def break_off(self) -> None:
        """What was begun does not count."""
        self._rising = False
        self._extreme: float | None = None

    def follow(self, height: float) -> None:
        """The next height, metres: turn round where it has come back `LEAST` from its extreme."""
        if self._extreme is None:
            self._extreme = height
        way = 1 if self._rising else -1
        if way * (height - self._extreme) >= 0:
            self._extreme = height
        elif way * (self._extreme - height) >= LEAST:
            self.count += self._rising
            self._rising, self._extreme = not self._rising, height

    def state(self) -> Memory:
        return {"count": self.count, "rising": self._rising, "extreme": self._extreme}

    def load(self, memory: Memory) -> None:
        self.count, self._rising, self._extreme = memory["count"], memory["rising"], memory["extreme"]
