"""Where episodes of behaviours start."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from labels_db.run_config import Behaviour
from tests.environments.given import started
from trainer.environments.behaviours.shapes import clearances

TOES = [f"toe_{end}_{side}" for end in ("front", "back") for side in ("left", "right")]


@pytest.mark.parametrize("seed", range(5))
def test_the_quadruped_starts_on_its_feet(seed: int) -> None:
    environment: Any = started(Behaviour(behaviour="quadruped-wave-left-front"), seed)
    data = environment.scene.data
    assert data.body("torso").xmat[8] == pytest.approx(1.0)
    assert clearances(environment._physics, TOES) == pytest.approx([0.0] * 4, abs=0.15)
    for _ in range(50):
        *_, info = environment.step(np.zeros(12, np.float32))
    assert info["measures"]["standing"] == 1.0


def test_the_quadruped_is_half_turned_to_the_viewer() -> None:
    """Its eyes are seen, so that its left can be told from its right."""
    headings = set()
    for seed in range(5):
        data = started(Behaviour(behaviour="quadruped-wave-left-front"), seed).scene.data
        headings.add(math.degrees(math.atan2(data.body("torso").xmat[3], data.body("torso").xmat[0])))
    assert len(headings) == 5
    assert all(-30 - 18 <= heading <= -30 + 18 for heading in headings)


@pytest.mark.parametrize("seed", range(5))
def test_the_hopper_starts_on_its_foot(seed: int) -> None:
    environment: Any = started(Behaviour(behaviour="hopper-backflip"), seed)
    assert abs(environment.scene.data.joint("rooty").qpos[0]) < 0.35
    assert clearances(environment._physics, ["foot"])[0] == pytest.approx(0.0, abs=1e-9)
    assert clearances(environment._physics, ["torso", "pelvis", "thigh"]).min() > 0.2
