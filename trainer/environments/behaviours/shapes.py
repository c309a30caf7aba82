"""Shapes of rewards in [0, 1], and how far the robot's parts are off the floor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt


def ramp(value: float, low: float, high: float) -> float:
    """0 up to `low`, 1 from `high` on, straight in between."""
    return min(max((value - low) / (high - low), 0.0), 1.0)


def clearances(physics: Any, geoms: Sequence[str]) -> npt.NDArray[np.float64]:
    """Metres [n] between the floor at z = 0 and the lowest points of spheres and capsules."""
    names = list(geoms)
    centre, tilt = physics.named.data.geom_xpos[names, "z"], physics.named.data.geom_xmat[names, "zz"]
    radius, half = physics.named.model.geom_size[names].T[:2]
    return np.asarray(centre - radius - half * np.abs(tilt))
