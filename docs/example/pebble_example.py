"""An environment, a behaviour, a teacher and a scheme of one's own, each as small as it can be."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from labels_db.models import Choice
from labels_db.run_config import Scripted
from trainer.environments import EnvironmentState, Observation, PhysicsState
from trainer.environments.behaviours import BehaviourSpec, Measures
from trainer.environments.behaviours.wish import Stateless
from trainer.environments.episodic import Control, EpisodicEnvironment
from trainer.query_selection import Picked, Selection, highest
from trainer.teachers import Two


class Corridor(EpisodicEnvironment):
    """A point that can be pushed along a corridor; the reward is how near it is to the middle."""

    control_step = 0.1
    episode_steps = 100
    state_size = 2

    def __init__(self, action_repeat: int) -> None:
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

    # Its moments: a run goes on from them, and clips are drawn from them.

    def physics_state(self) -> PhysicsState:
        return np.array([self._place, self._speed])

    def _go_to(self, state: EnvironmentState) -> None:
        self._place, self._speed = map(float, state.physics)

    def _beside_physics(self) -> dict[str, dict[str, Any]]:
        return {}

    @property
    def scene(self) -> CorridorScene:
        return CorridorScene()


class CorridorScene:
    """Draws itself: a dark point in a light corridor, whose middle is green."""

    name = "corridor"
    model = data = None  # it is no simulation of MuJoCo
    WIDTH, HEIGHT, HALF = 320, 80, 4.0

    def restore(self, episode_seed: int, state: PhysicsState) -> None:
        self._place = float(np.clip(state[0], -self.HALF, self.HALF))

    def picture(self) -> NDArray[np.uint8]:
        """[height, width, 3]."""
        drawn = np.full((self.HEIGHT, self.WIDTH, 3), 235, np.uint8)
        drawn[:, self._columns(0.0, half=1.0)] = (198, 232, 205)
        drawn[30:50, self._columns(self._place, half=0.12)] = (32, 48, 64)
        return drawn

    def _columns(self, place: float, half: float) -> slice:
        ends = (np.array([place - half, place + half]) / self.HALF + 1) / 2 * self.WIDTH
        left, right = np.clip(ends.round().astype(int), 0, self.WIDTH)
        return slice(left, right)


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
