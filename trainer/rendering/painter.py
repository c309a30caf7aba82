"""Draws scenes. This module loads OpenGL: only the rendering process imports it."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from trainer.environments import PhysicsState, Scene
from trainer.rendering import paint, stage
from trainer.rendering.framing import FIELD_OF_VIEW, Framing, framing
from trainer.rendering.meshes import coarse_meshes
from trainer.rendering.sheet import Frame

AXES = "xyz"
DETAIL = 2.0  # pixels: finer meshes than that only cost time


class Painter:
    """One scene and the one OpenGL context of this process."""

    def __init__(self, scene: Scene, width: int, height: int) -> None:
        self._scene = scene
        self._framing = framing(scene.name) or whole(scene.model)
        self._episode_drawn: int | None = None
        stage.dress(scene.model, width, height, self._framing.distance)
        scene.model.vis.global_.fovy = FIELD_OF_VIEW
        with stage.coarse_floor(scene.model), coarse_meshes(scene.model, self._pixel(height) * DETAIL):
            self._renderer = mujoco.Renderer(scene.model, height, width)
        self._renderer.scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False
        self._option = mujoco.MjvOption()
        self._option.flags[mujoco.mjtVisFlag.mjVIS_RANGEFINDER] = False

    def draw(self, episode_seed: int, state: PhysicsState) -> Frame:
        """The frame [height, width, 3] of a state [S] of that episode."""
        self._scene.restore(episode_seed, state)
        return self.draw_scene(episode_seed)

    def draw_scene(self, episode_seed: int) -> Frame:
        """The frame [height, width, 3] of the scene as it is, in that episode."""
        if episode_seed != self._episode_drawn:
            self._upload_terrain()
            self._episode_drawn = episode_seed
        model, data, scene = self._scene.model, self._scene.data, self._renderer.scene
        centre = self._centre()
        camera = self._camera(centre)
        mujoco.mjv_updateCamera(model, data, camera, scene)  # an endless floor goes where it last was
        with stage.endless_floor(model):
            self._renderer.update_scene(data, camera, self._option)
        stage.settle_ground(model, scene)
        stage.light(scene, centre, self._framing.distance)
        frame: Frame = self._renderer.render()
        if not paint.has_sky(model):
            paint.lighten_sky(frame)
        return frame

    def _pixel(self, height: int) -> float:
        """Metres that one pixel shows where the camera looks."""
        return 2 * self._framing.distance * math.tan(math.radians(FIELD_OF_VIEW) / 2) / height

    def _centre(self) -> npt.NDArray[np.float64]:
        """The point [3] that the camera looks at."""
        centre = np.array(self._framing.centre, np.float64)
        if self._framing.follows is not None:
            body = self._scene.data.body(self._framing.follows)
            for axis in map(AXES.index, self._framing.axes):
                centre[axis] += self._framing.share * body.subtree_com[axis]
        return centre

    def _camera(self, centre: npt.NDArray[np.float64]) -> Any:
        camera = mujoco.MjvCamera()
        camera.lookat, camera.distance = centre, self._framing.distance
        camera.azimuth, camera.elevation = self._framing.azimuth, self._framing.elevation
        return camera

    def _upload_terrain(self) -> None:
        # Each episode of quadruped-escape has its own terrain; mujoco.Renderer offers no other way to it.
        for field in range(self._scene.model.nhfield):
            mujoco.mjr_uploadHField(self._scene.model, self._renderer._mjr_context, field)


def whole(model: Any) -> Framing:
    """A framing of everything, for a robot that has none of its own."""
    x, y, z = model.stat.center
    return Framing((x, y, z), 2.2 * float(model.stat.extent), elevation=-20)
