"""Environments: `make_environment` turns a configuration into one, without loading OpenGL."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import MappingProxyType
from typing import Any

from labels_db.run_config import Behaviour, DMControl
from trainer.environments.behaviours import BEHAVIOURS
from trainer.environments.interface import (
    Action,
    Environment,
    EnvironmentState,
    Observation,
    PhysicsState,
    Scene,
)

__all__ = [
    "Action",
    "Environment",
    "EnvironmentState",
    "Observation",
    "PhysicsState",
    "Scene",
    "make_environment",
    "without_gl",
]


@contextmanager
def without_gl() -> Iterator[None]:
    """While simulators are imported: they look for OpenGL then, and warn or fail without a display."""
    before = os.environ.get("MUJOCO_GL")
    os.environ["MUJOCO_GL"] = "disable"
    try:
        yield
    finally:
        if before is None:
            del os.environ["MUJOCO_GL"]
        else:
            os.environ["MUJOCO_GL"] = before


def _task(config: DMControl) -> Environment:
    with without_gl():
        from trainer.environments.suite import SuiteEnvironment
    return SuiteEnvironment(config.task, config.action_repeat)


def _behaviour(config: Behaviour) -> Environment:
    with without_gl():
        from trainer.environments.suite import SuiteEnvironment
    if config.behaviour not in BEHAVIOURS:
        raise ValueError(f"{config.name}: unknown behaviour; one of {', '.join(BEHAVIOURS)}")
    behaviour = BEHAVIOURS[config.behaviour]
    return SuiteEnvironment(behaviour.task, config.action_repeat, behaviour.make_wish())


MAKERS: MappingProxyType[type, Callable[[Any], Environment]] = MappingProxyType(
    {DMControl: _task, Behaviour: _behaviour}
)


def make_environment(config: DMControl | Behaviour) -> Environment:
    """The environment of a configuration, not yet reset."""
    return MAKERS[type(config)](config)
