"""The colours of a scene: plain ones, in which what matters stands out. Only for drawing."""

from __future__ import annotations

from collections.abc import Callable
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

MATERIALS: dict[str, Colour] = {
    "self": (0.85, 0.54, 0.26),
    "effector": (0.80, 0.38, 0.20),
    "decoration": (0.30, 0.48, 0.68),
    "target": (0.78, 0.20, 0.27),
}
LEFT_LIMBS: Colour = (0.62, 0.34, 0.17)  # darker, so that one leg can be told from the other

FLOORS = ("floor", "ground")


def repaint(model: Any) -> None:
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
    for geom in planes(model, (*FLOORS, "table")):
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
    painted = None if paint is None else paint(width)[:height]  # a sky may have one face for all sides
    if painted is not None and painted.shape[:2] == (height, width):
        pixels[..., :3] = painted


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


def planes(model: Any, names: tuple[str, ...]) -> list[int]:
    """The planes among the geoms of those names."""
    named = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name) for name in names]
    return [geom for geom in named if geom >= 0 and model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE]


def has_sky(model: Any) -> bool:
    return bool((model.tex_type == mujoco.mjtTexture.mjTEXTURE_SKYBOX).any())


def lighten_sky(frame: npt.NDArray[np.uint8]) -> None:
    """Where a model has no sky, a frame [height, width, 3] is black; nothing that is lit is."""
    frame[(frame == 0).all(-1)] = np.round(255 * np.asarray(HORIZON))
