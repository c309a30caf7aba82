"""`python -m tests.rendering.live_scene CONFIG_AS_JSON`: draws an episode live, then again from its states.

A program of its own, because OpenGL must be chosen before the simulator is imported.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from labels_db.run_config import EnvironmentConfig
from tests.environments.given import actions
from trainer.environments import make_environment
from trainer.rendering.painter import Painter


def main() -> None:
    """Print the largest difference of a pixel, and that to another episode."""
    environment = make_environment(TypeAdapter[Any](EnvironmentConfig).validate_json(sys.argv[1]))
    painter = Painter(environment.scene, 160, 120)
    environment.reset(seed=8)
    other = environment.physics_state()
    painter.draw(8, other)
    environment.reset(seed=5)
    states, pictures = [], []
    for action in actions(environment, 5):
        environment.step(action)
        states.append(environment.physics_state())
        pictures.append(painter.draw_scene(5))
    elsewhere = painter.draw(8, other)
    again = [painter.draw(5, state) for state in states]
    differences = np.abs(np.array(again, int) - np.array(pictures, int))
    print(differences.max(), np.abs(elsewhere.astype(int) - pictures[0]).max())


if __name__ == "__main__":
    main()
