"""Quadruped: standing on three legs and waving the fourth."""

from __future__ import annotations

from typing import Any

import numpy as np

from trainer.environments.behaviours.shapes import clearances, ramp
from trainer.environments.behaviours.strokes import Strokes
from trainer.environments.behaviours.wish import Measures, Memory

LEGS = ("front_left", "front_right", "back_left", "back_right")  # as the robot itself would say


class Wave:
    """The robot stands on its other three feet and waves the foot of `leg` up and down in the air.

    The reward of a control step is upright × (`still` + (1 - `still`) × height × planted × raised × moving):
    upright, how far the torso is; height, its own up to 0.4 m; planted, the share of the other three toes on the
    floor; raised, the clearance of the waving toe, up to 0.1 m; moving, its speed up or down as seen from the torso,
    up to `fastest`, of which `held` is given for a foot held still.
    `waves` counts strokes up and down of at least 0.1 m while the robot stands on the other three feet; `standing` is
    the share of the episode that it stands upright.
    """

    fastest = 1.0  # m/s
    still, held = 0.2, 0.1

    def __init__(self, leg: str) -> None:
        self._toe = f"toe_{leg}"
        self._others = [f"toe_{other}" for other in LEGS if other != leg]

    def begin(self, physics: Any) -> None:
        del physics
        self._strokes, self._stood, self._steps = Strokes(), 0, 0

    def reward(self, physics: Any) -> float:
        upright, height = float(physics.torso_upright()), float(physics.named.data.xpos["torso", "z"])
        raised, *others = clearances(physics, [self._toe, *self._others])
        lifted, held_down = raised > 0, max(others) < 0.05
        self._watch(physics, upright > 0.9 and height > 0.3, bool(lifted and held_down))
        planted = float(np.mean([1 - ramp(other, 0.02, 0.1) for other in others]))
        moving = self.held + (1 - self.held) * ramp(abs(self._speed(physics)), 0.0, self.fastest)
        waving = ramp(height, 0.1, 0.4) * planted * ramp(float(raised), 0.0, 0.1) * moving
        return ramp(upright, -1.0, 0.95) * (self.still + (1 - self.still) * waving)

    def measures(self, physics: Any) -> Measures:
        del physics
        return {"waves": float(self._strokes.count), "standing": self._stood / max(self._steps, 1)}

    def state(self) -> Memory:
        return {"strokes": self._strokes.state(), "stood": self._stood, "steps": self._steps}

    def load(self, memory: Memory) -> None:
        self._strokes.load(memory["strokes"])
        self._stood, self._steps = memory["stood"], memory["steps"]

    def _watch(self, physics: Any, standing: bool, waving: bool) -> None:
        self._steps, self._stood = self._steps + 1, self._stood + standing
        toe, torso = physics.named.data.xpos[[self._toe, "torso"], "z"]
        self._strokes.follow(float(toe - torso)) if standing and waving else self._strokes.break_off()

    def _speed(self, physics: Any) -> float:
        """Of the waving toe along the torso's up axis, seen from the torso, m/s."""
        velocity = physics.data.object_velocity
        (toe, _), (torso, turning) = velocity(self._toe, "body"), velocity("torso", "body")
        data = physics.named.data
        carried = torso + np.cross(turning, data.xpos[self._toe] - data.xpos["torso"])
        return float((toe - carried) @ data.xmat["torso"].reshape(3, 3)[:, 2])
