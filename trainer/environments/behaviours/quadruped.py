"""Quadruped: standing on three legs and waving the fourth."""

from __future__ import annotations

from typing import Any

import numpy as np

from trainer.environments.behaviours.shapes import clearances, ramp
from trainer.environments.behaviours.strokes import Strokes
from trainer.environments.behaviours.wish import Measures, Memory

LAG = 10  # control steps of 0.02 s
LEGS = ("front_left", "front_right", "back_left", "back_right")  # as the robot itself would say


class Wave:
    """The robot stands on its other three feet and waves the foot of `leg` up and down in the air.

    The reward of a control step is upright × (`still` + (1 - `still`) × height × planted × raised × moving):
    upright, how far the torso is; height, its own up to 0.4 m; planted, the share of the other three toes on the
    floor; raised, the clearance of the waving toe, up to 0.1 m; moving, how far it has come up or down beside the torso
    in `LAG` control steps, 0.2 s, up to `far`, of which `held` is given for a foot held still. Its speed would not do:
    a tremble of two centimetres is as fast as a wave.
    `waves` counts strokes up and down of at least 0.1 m while the robot stands on the other three feet; `standing` is
    the share of the episode that it stands upright.
    """

    far = 0.1  # metres
    still, held = 0.2, 0.1

    def __init__(self, leg: str) -> None:
        self._toe = f"toe_{leg}"
        self._others = [f"toe_{other}" for other in LEGS if other != leg]

    def begin(self, physics: Any) -> None:
        del physics
        self._strokes, self._stood, self._steps = Strokes(), 0, 0
        self._heights: list[float] = []

    def reward(self, physics: Any) -> float:
        upright, height = float(physics.torso_upright()), float(physics.named.data.xpos["torso", "z"])
        raised, *others = clearances(physics, [self._toe, *self._others])
        lifted, held_down = raised > 0, max(others) < 0.05
        self._watch(physics, upright > 0.9 and height > 0.3, bool(lifted and held_down))
        planted = float(np.mean([1 - ramp(other, 0.02, 0.1) for other in others]))
        moving = self.held + (1 - self.held) * ramp(abs(self._heights[-1] - self._heights[0]), 0.0, self.far)
        waving = ramp(height, 0.1, 0.4) * planted * ramp(float(raised), 0.0, 0.1) * moving
        return ramp(upright, -1.0, 0.95) * (self.still + (1 - self.still) * waving)

    def measures(self, physics: Any) -> Measures:
        del physics
        return {"waves": float(self._strokes.count), "standing": self._stood / max(self._steps, 1)}

    def state(self) -> Memory:
        stood = {"stood": self._stood, "steps": self._steps}
        return {"strokes": self._strokes.state(), "heights": list(self._heights), **stood}

    def load(self, memory: Memory) -> None:
        self._strokes.load(memory["strokes"])
        self._stood, self._steps, self._heights = memory["stood"], memory["steps"], list(memory["heights"])

    def _watch(self, physics: Any, standing: bool, waving: bool) -> None:
        self._steps, self._stood = self._steps + 1, self._stood + standing
        toe, torso = physics.named.data.xpos[[self._toe, "torso"], "z"]
        self._heights = [*self._heights[-LAG:], float(toe - torso)]
        self._strokes.follow(self._heights[-1]) if standing and waving else self._strokes.break_off()
