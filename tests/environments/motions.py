"""Motions made by hand, to which behaviours are held."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import mujoco
import numpy as np

from labels_db.run_config import Behaviour, DMControl
from tests.environments.given import started
from trainer.environments import Action, Environment, PhysicsState
from trainer.environments.behaviours import Measures

SEED = 3
Pose = Mapping[str, float]
"""Joint or slide: radians or metres; all others are 0."""


def suite_environment(config: Behaviour | DMControl) -> Any:
    """At the start of an episode; `Any` because it has more than every environment has."""
    return started(config, SEED)


def states_of(environment: Environment, poses: Iterable[Pose]) -> PhysicsState:
    """The states [L, S] of going through these poses, one a control step."""
    model, data = environment.scene.model, environment.scene.data
    states, before = [], None
    for step, pose in enumerate(poses):
        data.qpos[:] = [pose.get(model.joint(joint).name, 0.0) for joint in range(model.njnt)]
        data.time = step * environment.control_step
        if before is not None:
            mujoco.mj_differentiatePos(model, data.qvel, environment.control_step, before, data.qpos)
        before = data.qpos.copy()
        states.append(environment.physics_state())
    return np.array(states)


def stand_up(environment: Environment, height: float) -> None:
    """A robot with a free root joint: level, still, all joints straight, its root so many metres up."""
    data = environment.scene.data
    data.qpos[:] = data.qvel[:] = 0.0
    data.act[:] = 0.0
    data.qpos[2:4] = height, 1.0
    environment.set_state(environment.get_state())


def action_of(environment: Environment, controls: Mapping[str, float]) -> Action:
    """The action that gives these actuators these controls and all others 0."""
    model = environment.scene.model
    low, high = model.actuator_ctrlrange.T
    wished = np.array([controls.get(model.actuator(i).name, 0.0) for i in range(model.nu)])
    action: Action = ((wished - low) / (high - low) * 2 - 1).astype(np.float32)
    return action


def judge(environment: Any, states: PhysicsState) -> tuple[list[float], Measures]:
    """Rewards [L - 1] and measures of an episode whose states [L, S] were stored from its start on."""
    environment.restore(SEED, states[0])
    environment._wish.begin(environment._physics)
    rewards = []
    for state in states[1:]:
        environment.restore(SEED, state)
        rewards.append(environment._wish.reward(environment._physics))
    return rewards, environment._wish.measures(environment._physics)
