"""What the tests of rendering start from."""

from __future__ import annotations

import io

import numpy as np
from PIL import Image

from labels_db.run_config import DMControl, EnvironmentConfig
from tests.environments.given import actions, started
from trainer.environments import PhysicsState
from trainer.rendering import EncodedClip
from trainer.rendering.sheet import Frame

SEED = 3
CART_POLE = DMControl(task="cartpole-swingup")


def lived(config: EnvironmentConfig, steps: int) -> PhysicsState:
    """The states [steps, S] of an episode with random actions."""
    environment = started(config, SEED)
    states = []
    for action in actions(environment, steps):
        states.append(environment.physics_state())
        environment.step(action)
    return np.array(states)


def frames(clip: EncodedClip) -> list[Frame]:
    """The frames of a sheet, in order."""
    with Image.open(io.BytesIO(clip.data)) as image:
        sheet = np.asarray(image.convert("RGB"))
    rows = sheet.reshape(clip.rows, clip.height, clip.columns, clip.width, 3).swapaxes(1, 2)
    return list(rows.reshape(-1, clip.height, clip.width, 3)[: clip.frames])
