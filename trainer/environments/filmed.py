"""Scenes of environments that cannot go back to a state to be drawn: the picture of each moment is its state."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from itertools import product

import numpy as np
import numpy.typing as npt
from PIL import Image, WebPImagePlugin

from trainer.environments.interface import PhysicsState

Picture = npt.NDArray[np.uint8]

WEBP = WebPImagePlugin.WebPImageFile.format
STATE_SIZE = 640
BYTES = 6
"""In each number of a state: as many as a double holds exactly."""
WIDTH, HEIGHT = 320, 240
"""At most, as clips are by default."""
SHRINKINGS = (1, 2, 4, 8)
QUALITIES = (80, 60, 40, 20, 0)
"""Flat drawings have room in the best and largest; photographs would not."""


def kept(picture: Picture) -> PhysicsState:
    """A picture [height, width, 3] as a state [STATE_SIZE], in the best quality that has room there."""
    data = next(data for data in _ever_smaller(picture) if len(data) <= STATE_SIZE * BYTES)
    padded = np.frombuffer(data.ljust(STATE_SIZE * BYTES, b"\0"), np.uint8).reshape(STATE_SIZE, BYTES)
    return padded.astype(np.float64) @ 256.0 ** np.arange(BYTES)


def _ever_smaller(picture: Picture) -> Iterator[bytes]:
    height, width, _ = picture.shape
    fitting = max(math.ceil(width / WIDTH), math.ceil(height / HEIGHT))
    for shrinking, quality in product(SHRINKINGS, QUALITIES):
        data = io.BytesIO()
        Image.fromarray(picture).reduce(fitting * shrinking).save(data, WEBP, quality=quality, method=0)
        yield data.getvalue()


def shown(state: PhysicsState) -> Picture:
    """The picture [height, width, 3] that a state [STATE_SIZE] keeps."""
    numbers = state.astype("<u8").view(np.uint8).reshape(STATE_SIZE, 8)
    data = io.BytesIO(numbers[:, :BYTES].tobytes())
    return np.asarray(Image.open(data, formats=[WEBP]).convert("RGB"))


class FilmScene:
    """Shows the pictures that were kept."""

    model = data = None

    def __init__(self, name: str, state: PhysicsState) -> None:
        self.name = name
        self.restore(0, state)

    def restore(self, episode_seed: int, state: PhysicsState) -> None:
        """Take up the picture in a state [S]."""
        if state.shape != (STATE_SIZE,):
            raise ValueError(
                f"state: shape {state.shape}, but a state of {self.name} has shape ({STATE_SIZE},)"
            )
        self._picture = shown(state)

    def picture(self) -> Picture:
        """What was seen then [height, width, 3]."""
        return self._picture
