"""What the camera sees, by geometry alone."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest

from labels_db.run_config import Clips, MetaWorld
from tests.environments.given import actions, started
from tests.rendering.given import lived
from trainer.rendering import Renderer, verify_clip
from trainer.rendering.framing import FIELD_OF_VIEW, Framing, framing

# The paper's six tasks.
TASKS = ("drawer-close", "window-open", "door-open", "button-press", "sweep-into", "drawer-open")
GRIPPER, OBJECT = slice(0, 3), slice(4, 7)  # in what Meta-world observes
Point = npt.NDArray[np.float64]


def seen_at(camera: Framing, point: Point, aspect: float = 4 / 3) -> tuple[float, float]:
    """Where a point [3] is in the frame, right and up, each from −1 to 1 inside it."""
    azimuth, elevation = math.radians(camera.azimuth), math.radians(camera.elevation)
    level = math.cos(elevation)
    ahead = np.array([level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation)])
    right = np.cross(ahead, [0, 0, 1]) / level
    away = point - (np.array(camera.centre) - camera.distance * ahead)
    reach = math.tan(math.radians(FIELD_OF_VIEW) / 2) * float(away @ ahead)
    return float(away @ right) / (reach * aspect), float(away @ np.cross(right, ahead)) / reach


def test_the_point_that_is_looked_at_is_in_the_middle() -> None:
    camera = Framing((1, 2, 3), 4.0, azimuth=30, elevation=-20)
    assert seen_at(camera, np.array([1.0, 2.0, 3.0])) == pytest.approx((0, 0))
    assert seen_at(camera, np.array([1.0, 2.0, 4.0]))[1] > 0


@pytest.mark.parametrize("task", TASKS)
def test_gripper_and_object_are_in_the_picture(task: str) -> None:
    camera = framing(f"metaworld-{task}")
    assert camera is not None
    for seed in range(3):
        environment = started(MetaWorld(task=task), seed)
        for action in actions(environment, 60):
            seen, *_ = environment.step(action)
            for part in (GRIPPER, OBJECT):
                right, up = seen_at(camera, seen[part].astype(np.float64))
                assert max(abs(right), abs(up)) < 0.95, (seed, part, right, up)


@pytest.mark.slow
@pytest.mark.contracts
@pytest.mark.parametrize("task", TASKS)
def test_clips_of_every_manipulation_task_are_drawn(task: str) -> None:
    config = MetaWorld(task=task)
    with Renderer(config, Clips()) as renderer:
        clip = renderer.clip(3, lived(config, 25), 0.04).result(120)
    verify_clip(clip)
    assert clip.frames == 25
