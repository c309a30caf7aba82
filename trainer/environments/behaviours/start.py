"""Where an episode of a behaviour starts, if not where its task does.

Righting itself from any position costs a quadruped a million steps, getting up costs a hopper nearly as many, and
neither is what is wished: they start on their feet. What is random in the task's own start stays so in part.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from trainer.environments.behaviours.shapes import clearances

Start = Callable[[Any], None]
"""Changes positions of the task's start."""

CROUCH: Mapping[str, float] = {
    "hip": -0.6,
    "knee": 1.2,
    "ankle": -0.6,
}  # rad: the sole is level, the torso above it
STANDING = 0.57  # metres, the torso of the quadruped in its model's own pose
HEADING = -math.pi / 6  # rad from +x; the camera stands at -π/3
SHARE = 0.1  # of the angles that the task drew


def as_the_task_starts(physics: Any) -> None:
    """Change nothing."""
    del physics


def on_four_feet(physics: Any) -> None:
    """The quadruped is level and half turned to the viewer, who must tell left from right by its eyes."""
    root = physics.named.data.qpos["root"]
    turned = 2 * math.atan2(root[6], root[3])  # about the vertical, as drawn
    heading = HEADING + SHARE * math.remainder(turned, math.tau)
    root[2:] = STANDING, math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2)


def crouching(physics: Any) -> None:
    """The hopper crouches upright on its foot, off by a share of what was drawn."""
    position = physics.named.data.qpos
    for joint in ("rooty", "waist", "hip", "knee", "ankle"):
        position[joint] = CROUCH.get(joint, 0.0) + SHARE * position[joint]
    physics.forward()
    position["rootz"] -= clearances(physics, ["foot"])[0]
