"""What is varied: one thing at a time around a middle, then what did well together."""

from __future__ import annotations

from collections.abc import Mapping

TASKS: Mapping[str, int] = {"cartpole-swingup": 4, "walker-walk": 2}
"""Each task's action repeat in the middle."""

MIDDLE: Mapping[str, str] = {
    "reward.kind": "true",
    "feedback.kind": "none",
    "exploration.kind": "random",
    "agent.width": "128",
    "agent.batch_size": "128",
    "agent.learning_rate": "1e-3",
    "agent.temperature_learning_rate": "1e-3",
    "agent.updates_per_step": "1",
    "agent.layer_norm": "false",
    "agent.replay_capacity": "500000",
    "total_steps": "10000000",
}

VARIATIONS: Mapping[str, Mapping[str, str]] = {
    "middle": {},
    "width 256": {"agent.width": "256"},
    "batch 256": {"agent.batch_size": "256"},
    "rate 3e-4": {"agent.learning_rate": "3e-4"},
    "half the repeat": {"environment.action_repeat": "/2"},
    "twice the repeat": {"environment.action_repeat": "*2"},
    "2 updates": {"agent.updates_per_step": "2"},
    "layer norm": {"agent.layer_norm": "true"},
    "batch 256, twice the repeat": {"agent.batch_size": "256", "environment.action_repeat": "*2"},
}


def settings(task: str, variation: str) -> dict[str, str]:
    """Paths and values on top of the task's preset."""
    chosen = {**MIDDLE, "environment.action_repeat": "*1", **VARIATIONS[variation]}
    how, factor = chosen["environment.action_repeat"][0], int(chosen["environment.action_repeat"][1:])
    repeat = TASKS[task] * factor if how == "*" else TASKS[task] // factor
    return {**chosen, "environment.action_repeat": str(repeat)}
