"""Draws environments that draw themselves; loads no OpenGL."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageOps

from trainer.environments import PhysicsState
from trainer.environments.filmed import FilmScene
from trainer.environments.pictured import PictureScene
from trainer.rendering.sheet import Frame

MARGIN = (255, 255, 255)


class PicturePainter:
    """Fits an environment's own pictures into frames, with a margin where their shape differs."""

    def __init__(self, scene: PictureScene | FilmScene, width: int, height: int) -> None:
        self._scene, self._size = scene, (width, height)

    def draw(self, episode_seed: int, state: PhysicsState) -> Frame:
        """The frame [height, width, 3] of a state [S] of that episode."""
        self._scene.restore(episode_seed, state)
        return self.draw_scene(episode_seed)

    def draw_scene(self, episode_seed: int) -> Frame:
        """The frame [height, width, 3] of the scene as it is."""
        del episode_seed
        picture = Image.fromarray(self._scene.picture())
        return np.asarray(ImageOps.pad(picture, self._size, color=MARGIN))
