"""Evaluation: episodes on an environment of its own with the policy's mean action; one is kept to be watched."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trainer.environments.interface import Environment
from trainer.randomness import derived_seed

Policy = Callable[[NDArray[np.float32]], NDArray[np.float32]]
"""Observations [N, D] → actions [N, A]."""


@dataclass(frozen=True)
class EvaluatedEpisode:
    """True return, the task's own measures at the end, and the simulator's state in each control step [T, S]."""

    seed: int
    true_return: float
    measures: dict[str, float]
    states: NDArray[np.float64]


def evaluate_episode(
    policy: Policy, environment: Environment, seed: int, between_steps: Callable[[], None]
) -> EvaluatedEpisode:
    """One episode; `between_steps` lets a stop request be answered in its middle."""
    observation, info = environment.reset(seed=seed)
    states, total, over = [], 0.0, False
    while not over:
        between_steps()
        observation, reward, terminated, truncated, info = environment.step(policy(observation[None])[0])
        states.append(environment.moments)
        total += float(reward)
        over = terminated or truncated
    states.append(environment.physics_state()[None])
    return EvaluatedEpisode(seed, total, dict(info.get("measures", {})), np.concatenate(states))


def evaluate(
    policy: Policy,
    environment: Environment,
    *,
    seed: int,
    episodes: int,
    between_steps: Callable[[], None] = lambda: None,
) -> list[EvaluatedEpisode]:
    """The same episodes at every evaluation of a run, so that its curve shows the policy alone."""
    seeds = [derived_seed(seed, "evaluation", episode) for episode in range(episodes)]
    return [evaluate_episode(policy, environment, episode, between_steps) for episode in seeds]


class EvaluationError(ValueError):
    """An evaluation measured nothing that can be kept."""


def returns_of(episodes: Sequence[EvaluatedEpisode]) -> list[float]:
    """The true returns; EvaluationError where one is no number, as a foreign environment's may be."""
    returns = [episode.true_return for episode in episodes]
    if not np.isfinite(returns).all():
        raise EvaluationError(f"returns {returns}: the environment's reward is no finite number")
    return returns


def mean_measures(episodes: Sequence[EvaluatedEpisode]) -> dict[str, float]:
    """Each of the task's measures, averaged over episodes."""
    return {name: float(np.mean([e.measures[name] for e in episodes])) for name in episodes[0].measures}
