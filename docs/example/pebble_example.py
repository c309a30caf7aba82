"""An environment, a behaviour, a teacher and a scheme of one's own, each as small as it can be."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from torch import Tensor

from labels_db.models import Choice
from labels_db.run_config import Scripted
from trainer.environments import EnvironmentState, Observation, PhysicsState, Scene
from trainer.environments.behaviours import BehaviourSpec, Measures
from trainer.environments.behaviours.wish import Stateless
from trainer.environments.episodic import Control, EpisodicEnvironment
from trainer.query_selection import Picked, Selection, highest
from trainer.teachers import Two


class Corridor(EpisodicEnvironment):
    """A point that can be pushed along a corridor; the reward is how near it is to the middle."""

    control_step = 0.1
    episode_steps = 100

    def __init__(self, action_repeat: int) -> None:
        self._place, self._speed = 0.0, 0.0
        self._make_ready(action_size=1, action_repeat=action_repeat)

    def _begin(self, seed: int) -> None:
        self._place, self._speed = float(np.random.default_rng(seed).uniform(-2, 2)), 0.0

    def _control_step(self, control: Control) -> tuple[float, bool, bool]:
        self._speed += self.control_step * float(control[0])
        self._place += self.control_step * self._speed
        return max(0.0, 1 - abs(self._place)), False, False

    def _observe(self) -> Observation:
        return np.array([self._place, self._speed], np.float32)

    def _measures(self) -> Measures:
        return {"distance": abs(self._place)}

    # How it goes on from a checkpoint; it cannot be drawn, so only scripted teachers can be asked.

    def _beside_physics(self) -> dict[str, dict[str, Any]]:
        return {"task": {"place": self._place, "speed": self._speed}}

    def _go_to(self, state: EnvironmentState) -> None:
        self._place, self._speed = state.task["place"], state.task["speed"]

    state_size = 0

    def physics_state(self) -> PhysicsState:
        return np.empty(0)

    @property
    def scene(self) -> Scene:
        raise NotImplementedError("corridor: nobody has said how it looks")


class Hang(Stateless):
    """The pendulum hangs still: the reward is 1 less its speed."""

    def begin(self, physics: Any) -> None:
        """Nothing needs to be remembered."""

    def reward(self, physics: Any) -> float:
        return max(0.0, 1 - abs(float(physics.named.data.qvel["hinge"][0])))

    def measures(self, physics: Any) -> Measures:
        return {"speed": abs(float(physics.named.data.qvel["hinge"][0]))}


hang = BehaviourSpec(
    title="Pendulum · hang still",
    goal="Prefer the clip in which the pendulum moves less.",
    task="pendulum-swingup",
    make_wish=Hang,
)


def impatient(
    _config: Scripted, returns: Two, _felt: Two, _average: float, _rng: np.random.Generator
) -> Choice:
    """Calls everything equal that is not twice as good; heeds none of the configured faults."""
    if max(returns) < 2 * min(returns):
        return Choice.EQUAL
    return Choice.FIRST if returns[0] > returns[1] else Choice.SECOND


def nearness_to_even(probabilities: Tensor) -> Tensor:
    """Of each candidate, by every member's P[σ¹ ≻ σ⁰]: [E, n] → [n]."""
    return -(probabilities.mean(0) - 0.5).abs()


def undecided(wanted: Selection) -> Picked:
    """Pairs on which the ensemble's mean is closest to even, whatever the single members say."""
    return partial(highest, nearness_to_even)(wanted)
