"""Units of work of drawing: clips."""

from __future__ import annotations

import io
import os
from typing import Any

import numpy as np

from benchmarks.speed.work import Work
from labels_db.run_config import Clips, DMControl
from trainer.rendering.process import ONE_CORE


def clip(scene: str) -> Work:
    """25 frames of 320 × 240, drawn and encoded as the rendering process does."""
    os.environ.update(ONE_CORE)  # before OpenGL is loaded, as the rendering process has it
    from trainer.environments import make_environment
    from trainer.rendering.painter import Painter
    from trainer.rendering.sheet import encode_clip

    environment = make_environment(DMControl(task=scene))
    environment.reset(seed=0)
    states = [environment.physics_state() for _ in range(25) if environment.step(_action(environment))]
    painter = Painter(make_environment(DMControl(task=scene)).scene, Clips().width, Clips().height)
    times = tuple(index / 25 for index in range(25))
    return lambda: encode_clip([painter.draw(0, state) for state in states], times, 1.0)


def clip_by_defaults(scene: str) -> Work:
    """25 frames as dm_control draws them, tiled, as the WebP that Pillow writes when told nothing."""
    from dm_control import suite
    from PIL import Image

    domain, name = scene.split("-", 1)
    environment = suite.load(domain, name)
    environment.reset()
    spec = environment.action_spec()

    def work() -> int:
        frames = []
        for _ in range(25):
            environment.step(np.random.uniform(spec.minimum, spec.maximum))
            frames.append(environment.physics.render(height=240, width=320, camera_id=0))
        rows = [np.concatenate(frames[start : start + 5], 1) for start in range(0, 25, 5)]
        file = io.BytesIO()
        Image.fromarray(np.concatenate(rows)).save(file, "WEBP")
        return file.tell()

    return work


def _action(environment: Any) -> Any:
    return np.random.default_rng(0).uniform(-1, 1, environment.action_space.shape).astype(np.float32)
