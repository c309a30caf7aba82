"""Training that went astray: losses or parameters that are no numbers any more.

Nothing would be learned from then on, and nothing would say so: a policy of NaN still acts, and a curve has a gap
where its loss is not finite. The run ends at once instead, and its checkpoints are all of before.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from trainer.state_tree import pack

LEARNED = ("agent", "reward")
"""Parts of a training's state whose every number must be finite."""


class DivergedError(Exception):
    """What a run learns is no number any more."""

    def __init__(self, what: str, step: int) -> None:
        super().__init__(
            f"{what} is no finite number at step {step}: training diverged. Start a run with lower learning rates "
            "(agent.learning_rate, agent.temperature_learning_rate, reward.learning_rate)."
        )


def refuse_diverged_losses(step: int, losses: Mapping[str, float]) -> None:
    """DivergedError that names the first loss that is not finite."""
    for name, value in losses.items():
        if not math.isfinite(value):
            raise DivergedError(name, step)


def refuse_diverged_state(step: int, state: Mapping[str, Any]) -> None:
    """DivergedError that names the first array of a training's `state()` that is not finite.

    Losses do not say it all: a rectifier may turn a NaN into the zero of a unit that is never heard of again.
    """
    _, arrays = pack({part: state[part] for part in LEARNED})
    for name, values in arrays.items():
        if not np.isfinite(values).all():
            raise DivergedError(name.lstrip("/"), step)
