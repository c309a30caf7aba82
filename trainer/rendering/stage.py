"""How a scene looks: a plain sky, a pale floor, one soft key light with a shadow. Only for drawing."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

Colour = tuple[float, float, float]

ZENITH: Colour = (0.60, 0.71, 0.83)
HORIZON: Colour = (0.89, 0.92, 0.95)
TILES: tuple[Colour, Colour] = ((0.76, 0.79, 0.82), (0.70, 0.735, 0.77))
BACKDROP: Colour = (0.72, 0.79, 0.86)
WOOD: Colour = (0.84, 0.77, 0.68)  # pale, so that small things on Meta-world's table can be seen
METAL: Colour = (0.62, 0.65, 0.69)
SLICES = 18  # around a limb, in frames 240 pixels high
SHADOW_TEXELS = 2.6  # per pixel of a frame's height
SHADOW_REACH = 0.45  # of the camera's distance: all that the frame shows casts its shadow
FAR = 40.0  # times the camera's distance
GROUND = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)
FLOORS = ("floor", "ground")
KEY_DIRECTION = (0.35, 0.45, -0.82)

MATERIALS: dict[str, Colour] = {
    "self": (0.85, 0.54, 0.26),
    "effector": (0.80, 0.38, 0.20),
    "decoration": (0.30, 0.48, 0.68),
    "target": (0.78, 0.20, 0.27),
}
LEFT_LIMBS: Colour = (0.62, 0.34, 0.17)  # darker, so that one leg can be told from the other


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
    _repaint(model)


def _repaint(model: Any) -> None:
    """Our colours for what the suite's models name alike."""
    names = [model.mat(material).name for material in range(model.nmat)]
    for material, name in enumerate(names):
        model.mat_rgba[material, :3] = MATERIALS.get(name, model.mat_rgba[material, :3])
    for geom in range(model.ngeom):
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_HFIELD:
            model.geom_rgba[geom, :3] = TILES[1]
        elif "left" in model.body(model.geom_bodyid[geom]).name:
            model.geom_rgba[geom] = (*LEFT_LIMBS, 1)
    if "target" in names:  # acrobot hides the very thing that people must look for
        model.site_group[model.site_matid == names.index("target")] = 0
    for geom in _planes(model, (*FLOORS, "table")):
        _repaint_plane(model, geom)
    for texture in range(model.ntex):
        _retexture(model, texture)


def _repaint_plane(model: Any, geom: int) -> None:
    """A plane of one colour becomes pale; one with a texture shows it, in tiles of half a metre."""
    material = model.geom_matid[geom]
    if material < 0:
        model.geom_rgba[geom] = (*TILES[1], 1)
    elif not model.mat_texuniform[material]:
        model.geom_rgba[geom] = 0.5, 0.5, 0.5, 1  # MuJoCo's word for "as the material is"
        model.mat_texuniform[material], model.mat_texrepeat[material] = True, (1, 1)


def _retexture(model: Any, texture: int) -> None:
    """Star fields, backgrounds, wood and metal become plain, the suite's dark grid pale; other textures stay."""
    start, channels = model.tex_adr[texture], model.tex_nchannel[texture]
    height, width = model.tex_height[texture], model.tex_width[texture]
    pixels = model.tex_data[start : start + height * width * channels].reshape(height, width, channels)
    is_sky = model.tex_type[texture] == mujoco.mjtTexture.mjTEXTURE_SKYBOX
    paint = _sky if is_sky else TEXTURES.get(model.tex(texture).name)
    if paint is not None:
        pixels[:] = paint(width)


def _sky(side: int) -> npt.NDArray[np.uint8]:
    """Six faces [6·side, side, 3]: right, left, up, down, front, back."""
    height = np.linspace(1, -1, side)[:, None, None]  # +1 at a side face's top, 0 at the horizon
    wall = _mix(HORIZON, ZENITH, np.broadcast_to(np.clip(height, 0, 1) ** 0.8, (side, side, 1)))
    up, down = (
        _mix(HORIZON, ZENITH, np.ones((side, side, 1))),
        _mix(HORIZON, ZENITH, np.zeros((side, side, 1))),
    )
    return np.concatenate([wall, wall, up, down, wall, wall])


def _checks(side: int) -> npt.NDArray[np.uint8]:
    """Two by two tiles [side, side, 3]."""
    second_half = np.arange(side) >= side // 2
    odd = (second_half[:, None] ^ second_half[None, :]).astype(float)
    return _mix(*TILES, odd[:, :, None])


def _plain(colour: Colour, side: int) -> npt.NDArray[np.uint8]:
    """One colour [side, side, 3]."""
    return _mix(colour, colour, np.zeros((side, side, 1)))


def _mix(first: Colour, second: Colour, share: npt.NDArray[np.float64]) -> npt.NDArray[np.uint8]:
    mixed = np.asarray(first) * (1 - share) + np.asarray(second) * share
    return np.round(255 * mixed).astype(np.uint8)


TEXTURES: dict[str, Callable[[int], npt.NDArray[np.uint8]]] = {
    "grid": _checks,
    "texplane": _checks,
    "background": partial(_plain, BACKDROP),
    "T_floor": partial(_plain, TILES[0]),
    "T_table": partial(_plain, WOOD),
    "T_wallmetal": partial(_plain, METAL),
}


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
    return _planes(model, FLOORS)


def _planes(model: Any, names: tuple[str, ...]) -> list[int]:
    named = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name) for name in names]
    return [geom for geom in named if geom >= 0 and model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE]


def has_sky(model: Any) -> bool:
    return bool((model.tex_type == mujoco.mjtTexture.mjTEXTURE_SKYBOX).any())


def lighten_sky(frame: npt.NDArray[np.uint8]) -> None:
    """Where a model has no sky, a frame [height, width, 3] is black; nothing that is lit is."""
    frame[(frame == 0).all(-1)] = np.round(255 * np.asarray(HORIZON))


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
