"""What is read from a task of the dm_control suite; import it as `trainer.environments.suite` is."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import MappingProxyType
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt
from absl import logging
from dm_control import suite

from trainer.environments.behaviours.turns import TakingTurns
from trainer.environments.behaviours.wish import Gauge, Measures, Memory, NoGauge

UNLIMITED_EPISODE_STEPS = 1000  # lqr sets no time limit; every other task has 1000 control steps

# The hand-made reward is content with one leg: how well both are used shows whether a gait is natural.
GAUGES: MappingProxyType[str, Callable[[], Gauge]] = MappingProxyType({"walker-walk": TakingTurns})


class TaskReward:
    """The task's own reward, and a gauge that looks on."""

    def __init__(self, task: Any, gauge: Gauge) -> None:
        self._task, self._gauge = task, gauge

    def begin(self, physics: Any) -> None:
        self._gauge.begin(physics)

    def reward(self, physics: Any) -> float:
        self._gauge.watch(physics)
        return float(self._task.get_reward(physics))

    def measures(self, physics: Any) -> Measures:
        del physics
        return self._gauge.measures()

    def state(self) -> Memory:
        return self._gauge.state()

    def load(self, memory: Memory) -> None:
        self._gauge.load(memory)


def gauge_of(name: str) -> Gauge:
    """What is measured in a task beside its reward."""
    return GAUGES.get(name, NoGauge)()


def build(name: str) -> Any:
    """dm_control's environment of a task, without its compiler's remarks on the suite's own models."""
    verbosity = logging.get_verbosity()
    logging.set_verbosity(logging.ERROR)
    try:
        # lqr draws its masses and springs when it is built: the same ones in every process.
        return suite.load(*split(name), task_kwargs={"random": 0})
    finally:
        logging.set_verbosity(verbosity)


def split(name: str) -> tuple[str, str]:
    """Domain and task of a name such as `ball_in_cup-catch`; ValueError names the suite's tasks."""
    domain, _, task = name.partition("-")
    if (domain, task) not in suite.ALL_TASKS:
        known = ", ".join("-".join(pair) for pair in suite.ALL_TASKS)
        raise ValueError(f"dmc:{name}: unknown task; one of {known}")
    return domain, task


def headless(physics: Any) -> Any:
    """The same physics without drawing: quadruped-escape would open a window to show its terrain."""
    physics._make_rendering_contexts = lambda: None
    return physics


def steps_of_episode(built: Any) -> int:
    """Control steps of an episode of a built task."""
    limit = built._step_limit
    return math.ceil(limit) if math.isfinite(limit) else UNLIMITED_EPISODE_STEPS


def action_range(spec: Any) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Centre and reach [A] of the task's actions; actuators without limits (lqr) take [-1, 1] as it is."""
    limited = spec.maximum < mujoco.mjMAXVAL
    low, high = np.where(limited, spec.minimum, -1.0), np.where(limited, spec.maximum, 1.0)
    return (high + low) / 2, (high - low) / 2
