"""Shapes of rewards in [0, 1], and how far the robot's parts are off the floor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt


def ramp(value: float, low: float, high: float) -> float:
    """0 up to `low`, 1 from `high` on, straight in between."""
    return min(max((value - low) / (high - low), 0.0), 1.0)


def rows_of(physics: Any, geoms: Sequence[str]) -> list[int]:
    """Where the simulator keeps shapes of those names: several times faster than its named arrays."""
    return [physics.model.name2id(name, "geom") for name in geoms]


def clearances(physics: Any, geoms: Sequence[str]) -> npt.NDArray[np.float64]:
    """Metres [n] between the floor at z = 0 and the lowest points of spheres and capsules."""
    rows = rows_of(physics, geoms)
    centre, tilt = physics.data.geom_xpos[rows, 2], physics.data.geom_xmat[rows, 8]
    radius, half = physics.model.geom_size[rows].T[:2]
    return np.asarray(centre - radius - half * np.abs(tilt))
