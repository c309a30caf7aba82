"""How a scene is set: an endless floor, one soft key light with a shadow. Only for drawing."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from trainer.rendering.paint import FLOORS, HORIZON, planes, repaint

SLICES = 18  # around a limb, in frames 240 pixels high
SHADOW_TEXELS = 2.6  # per pixel of a frame's height
SHADOW_REACH = 0.45  # of the camera's distance: all that the frame shows casts its shadow
FAR = 40.0  # times the camera's distance
GROUND = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)
KEY_DIRECTION = (0.35, 0.45, -0.82)


def dress(model: Any, width: int, height: int, reach: float) -> None:
    """Give a model its looks for frames of that size, seen from `reach` metres away."""
    model.vis.global_.offwidth, model.vis.global_.offheight = width, height
    model.vis.quality.offsamples, model.vis.quality.shadowsize = 0, round(SHADOW_TEXELS * height)
    # Vertices are what software OpenGL spends its time on: no more than keep outlines round at this size.
    model.vis.quality.numslices = 2 * round(SLICES * math.sqrt(height / 240) / 2)
    model.vis.quality.numstacks = model.vis.quality.numslices // 2
    # Everything below is in units of the extent, so that one set of numbers serves ants and acrobats.
    model.stat.extent = reach
    model.vis.map.znear, model.vis.map.zfar = 0.02, FAR
    model.vis.map.shadowclip, model.vis.map.haze = SHADOW_REACH, 0.5
    model.vis.rgba.haze[:] = (*HORIZON, 1)
    model.vis.rgba.constraint[:] = (0.35, 0.38, 0.42, 1)  # a taut string stays as grey as a slack one
    model.mat_reflectance[:] = 0
    repaint(model)


@contextmanager
def coarse_floor(model: Any) -> Iterator[None]:
    """While the OpenGL context is made the floor is vast, of few large quads; an endless one has 40 000."""
    half = _vast(model)
    with _floor_size(model, (half, half, half)):
        yield


@contextmanager
def endless_floor(model: Any) -> Iterator[None]:
    """While a scene is built the floor has no end: it goes where the camera goes, and fades into the haze."""
    with _floor_size(model, (0, 0, 1)):
        yield


@contextmanager
def _floor_size(model: Any, size: tuple[float, float, float]) -> Iterator[None]:
    """The floor in that size for a while; resets read its true size, so it comes back."""
    floors = _floors(model)
    sizes = model.geom_size[floors].copy()
    model.geom_size[floors] = size
    yield
    model.geom_size[floors] = sizes


def _vast(model: Any) -> float:
    """Half a side of a floor that reaches beyond what the camera sees, even so that tiles meet in its middle."""
    return 2.0 * math.ceil(0.55 * FAR * float(model.stat.extent))


def _floors(model: Any) -> list[int]:
    return planes(model, FLOORS)


def settle_ground(model: Any, scene: Any) -> None:
    """Ground casts no shadow, for it would fill the shadow map, and is matt; the floor keeps its tiles."""
    floors = _floors(model)
    for geom in scene.geoms[: scene.ngeom]:
        if geom.type in GROUND:
            geom.category, geom.specular = mujoco.mjtCatBit.mjCAT_DECOR, 0
        if geom.type == mujoco.mjtGeom.mjGEOM_PLANE and geom.objid in floors:
            geom.texrepeat *= _vast(model)  # the texture was laid out for a floor of that size


def light(scene: Any, centre: npt.NDArray[np.float64], reach: float) -> None:
    """Replace a scene's lights: a soft one at the camera and a key light over `centre` [3]."""
    soft, key = scene.lights[0], scene.lights[1]
    scene.nlight = 2
    _set(soft, ambient=0.46, diffuse=0.22, specular=0.0)
    soft.headlight, soft.castshadow = 1, 0
    _set(key, ambient=0.0, diffuse=0.42, specular=0.15)
    key.headlight, key.castshadow = 0, 1
    key.pos = centre - reach * np.asarray(KEY_DIRECTION)
    key.dir = np.asarray(KEY_DIRECTION) / np.linalg.norm(KEY_DIRECTION)


def _set(source: Any, **strengths: float) -> None:
    source.type = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    source.attenuation, source.texid = (1, 0, 0), -1
    for name, strength in strengths.items():
        setattr(source, name, (strength, strength, strength))
