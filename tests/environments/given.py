"""What the tests of environments start from."""

from __future__ import annotations

import numpy as np

from labels_db.run_config import Behaviour, DMControl
from trainer.environments import Action, Environment, make_environment
from trainer.environments.behaviours import BEHAVIOURS
from trainer.environments.goals import TITLES

Config = DMControl | Behaviour

ALL: list[Config] = [
    *(DMControl(task=task) for task in TITLES),
    *(Behaviour(behaviour=name) for name in BEHAVIOURS),
]
# Each stands for something: Runge-Kutta, contacts, terrain, no limits, targets moved at reset, a wish.
SAMPLE: list[Config] = [
    DMControl(task="cartpole-three_poles"),
    DMControl(task="walker-walk"),
    DMControl(task="quadruped-escape"),
    DMControl(task="lqr-lqr_6_2"),
    DMControl(task="manipulator-insert_peg"),
    DMControl(task="ball_in_cup-catch", action_repeat=3),
    Behaviour(),
]


def name(config: Config) -> str:
    return config.name


def actions(environment: Environment, count: int) -> list[Action]:
    """As many uniformly random actions, the same ones every time."""
    shape, draw = environment.action_space.shape, np.random.default_rng(0)
    return [draw.uniform(-1, 1, shape).astype(np.float32) for _ in range(count)]


def started(config: Config, seed: int = 3) -> Environment:
    """An environment at the start of an episode."""
    environment = make_environment(config)
    environment.reset(seed=seed)
    return environment
