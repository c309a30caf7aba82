"""What a behaviour asks of a robot: a true reward over the simulator, and measures that people understand."""

from __future__ import annotations

from typing import Any, Protocol

Measures = dict[str, float]
Memory = dict[str, Any]


class Wish(Protocol):
    """A person's wish, put as a reward; what it remembers of an episode is part of the environment's state."""

    def begin(self, physics: Any) -> None:
        """An episode starts in this state of the simulator."""

    def reward(self, physics: Any) -> float:
        """The true reward of the control step that just ended; called once for each."""

    def measures(self, physics: Any) -> Measures:
        """What has been reached so far in the episode."""

    def state(self) -> Memory:
        """What is remembered since `begin`, as JSON; {} if nothing is."""

    def load(self, memory: Memory) -> None:
        """Remember what `state` gave, after `begin` in the same episode."""


class Gauge(Protocol):
    """Looks on and measures, whatever is rewarded; remembers as a wish does."""

    def begin(self, physics: Any) -> None:
        """An episode starts in this state of the simulator."""

    def watch(self, physics: Any) -> float:
        """The next state, in [0, 1]: how good it is in the gauge's own sense."""

    def measures(self) -> Measures:
        """What has been seen so far in the episode."""

    def state(self) -> Memory:
        """What is remembered since `begin`, as JSON; {} if nothing is."""

    def load(self, memory: Memory) -> None:
        """Remember what `state` gave."""


class Stateless:
    """For wishes that remember nothing but the episode's start."""

    def state(self) -> Memory:
        return {}

    def load(self, memory: Memory) -> None:
        del memory


class NoGauge(Stateless):
    """Measures nothing."""

    def begin(self, physics: Any) -> None: ...

    def watch(self, physics: Any) -> float:
        del physics
        return 0.0

    def measures(self) -> Measures:
        return {}
