"""Environments: `make_environment` turns a configuration into one, without loading OpenGL."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import MappingProxyType
from typing import Any

from labels_db.catalogue import EnvironmentUnavailableError
from labels_db.run_config import (
    Behaviour,
    DMControl,
    EnvironmentConfig,
    Gymnasium,
    InstalledEnvironment,
    MetaWorld,
)
from trainer import extensions
from trainer.environments.behaviours import BEHAVIOURS, BehaviourSpec
from trainer.environments.interface import (
    Action,
    Environment,
    EnvironmentState,
    Observation,
    PhysicsState,
    Scene,
)
from trainer.extensions import installed

__all__ = [
    "Action",
    "Environment",
    "EnvironmentState",
    "Observation",
    "PhysicsState",
    "Scene",
    "behaviour_named",
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


@contextmanager
def extra(package: str, wanted_by: str) -> Iterator[None]:
    """While a package is imported that only an extra installs: says which one where it is missing."""
    try:
        yield
    except ModuleNotFoundError as error:
        if error.name != package:
            raise
        how = f"install it with: pip install 'pebble-teach[{package}]'"
        raise ModuleNotFoundError(f"{wanted_by} needs the package {package}; {how}", name=package) from error


def _task(config: DMControl) -> Environment:
    with without_gl():
        from trainer.environments.suite import SuiteEnvironment
    return SuiteEnvironment(config.task, config.action_repeat)


def _behaviour(config: Behaviour) -> Environment:
    with without_gl():
        from trainer.environments.suite import SuiteEnvironment
    behaviour = behaviour_named(config.behaviour)
    return SuiteEnvironment(behaviour.task, config.action_repeat, behaviour.make_wish(), behaviour.start)


def behaviour_named(name: str) -> BehaviourSpec:
    """Ours, or an installed package's; ValueError names the ones there are."""
    if name in BEHAVIOURS:
        return BEHAVIOURS[name]
    try:
        found: BehaviourSpec = installed(extensions.BEHAVIOURS, name)
    except ValueError as error:
        raise ValueError(f"{name}: unknown behaviour; one of {', '.join(BEHAVIOURS)}; {error}") from error
    return found


def _meta_world(config: MetaWorld) -> Environment:
    with without_gl(), extra("metaworld", config.name):
        from trainer.environments.meta_world import MetaWorldEnvironment
    return MetaWorldEnvironment(config.task, config.action_repeat, goal_visible=config.goal_visible)


def _registered(config: Gymnasium) -> Environment:
    with without_gl():
        from trainer.environments.gym_environment import registered

        return registered(config.id, config.action_repeat)


def _installed(config: InstalledEnvironment) -> Environment:
    with without_gl():
        made: Environment = installed(extensions.ENVIRONMENTS, config.environment)(config.action_repeat)
    return made


MAKERS: MappingProxyType[type, Callable[[Any], Environment]] = MappingProxyType(
    {
        DMControl: _task,
        Behaviour: _behaviour,
        MetaWorld: _meta_world,
        Gymnasium: _registered,
        InstalledEnvironment: _installed,
    }
)


def make_environment(config: EnvironmentConfig) -> Environment:
    """The environment of a configuration, not yet reset; EnvironmentUnavailableError where it cannot be made here."""
    try:
        return MAKERS[type(config)](config)
    except (ValueError, ModuleNotFoundError) as error:
        raise EnvironmentUnavailableError(str(error)) from error
