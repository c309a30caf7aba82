"""What the tests of environments start from."""

from __future__ import annotations

import numpy as np

from labels_db.run_config import Behaviour, DMControl, EnvironmentConfig, Gymnasium, MetaWorld
from trainer.environments import Action, Environment, make_environment
from trainer.environments.behaviours import BEHAVIOURS
from trainer.environments.goals import TITLES
from trainer.environments.gym_goals import GYM_GOALS
from trainer.environments.meta_world_goals import META_WORLD_TITLES

Config = EnvironmentConfig

QUICK: list[Config] = [
    *(DMControl(task=task) for task in TITLES),
    *(Behaviour(behaviour=name) for name in BEHAVIOURS),
    *(Gymnasium(id=id) for id in GYM_GOALS),
]
META_WORLD: list[Config] = [MetaWorld(task=task) for task in META_WORLD_TITLES]
# Each stands for something: Runge-Kutta, contacts, terrain, no limits, targets moved at reset, a hand moved by mocap,
# a reward that remembers the start, one that needs the step before, no MuJoCo at all, one that is
# filmed, a wish, and what wishes remember.
SAMPLE: list[Config] = [
    DMControl(task="cartpole-three_poles"),
    DMControl(task="walker-walk"),
    DMControl(task="quadruped-escape"),
    DMControl(task="lqr-lqr_6_2"),
    DMControl(task="manipulator-insert_peg"),
    DMControl(task="ball_in_cup-catch", action_repeat=3),
    MetaWorld(task="drawer-close"),
    MetaWorld(task="bin-picking", goal_visible=True, action_repeat=2),
    Gymnasium(id="Ant-v5"),
    Gymnasium(id="Pendulum-v1", action_repeat=2),
    Gymnasium(id="LunarLanderContinuous-v3", action_repeat=2),
    Behaviour(),
    Behaviour(behaviour="quadruped-wave-left-front"),
    Behaviour(behaviour="hopper-backflip", action_repeat=2),
]


def name(config: Config) -> str:
    return config.name


def actions(environment: Environment, count: int) -> list[Action]:
    """As many uniformly random actions, the same ones every time."""
    shape, draw = environment.action_space.shape, np.random.default_rng(0)
    return [draw.uniform(-1, 1, shape).astype(np.float32) for _ in range(count)]


def lived(environment: Environment, steps: int) -> None:
    """Go that many random steps, through as many episodes as it takes."""
    for number, action in enumerate(actions(environment, steps)):
        _, _, terminated, truncated, _ = environment.step(action)
        if terminated or truncated:
            environment.reset(seed=number)


def started(config: Config, seed: int = 3) -> Environment:
    """An environment at the start of an episode."""
    environment = make_environment(config)
    environment.reset(seed=seed)
    return environment
