"""Training that went astray: losses or parameters that are no numbers any more.

Nothing is learned from then on, but a policy of NaN still acts and is evaluated. So the run ends, with the next losses
that are recorded or before the next checkpoint is written, whose parameters are therefore all numbers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from trainer.state_tree import pack

if TYPE_CHECKING:
    from trainer.training import Training


class DivergedError(Exception):
    """What a run learns is no number any more."""

    def __init__(self, what: str, step: int) -> None:
        super().__init__(
            f"{what} is not finite any more at step {step}: training diverged. Start a run with lower learning rates, "
            "or look for observations and rewards of the environment that are no numbers."
        )


def refuse_diverged_losses(step: int, losses: Mapping[str, float]) -> None:
    """DivergedError that names the first loss that is not finite."""
    for name, value in losses.items():
        if not math.isfinite(value):
            raise DivergedError(name, step)


def refuse_diverged_networks(training: Training) -> None:
    """DivergedError where agent or reward model hold what is not finite.

    Losses do not say it all: a rectifier may turn a NaN into the zero of a unit that is never heard of again.
    """
    if (found := divergence(training)) is not None:
        raise found


def divergence(training: Training) -> DivergedError | None:
    """Names the first array that is not finite; the reward model's come first, since what they spoil is the agent."""
    _, arrays = pack({"reward": training.reward.state(), "agent": training.agent.state()})
    spoilt = (name for name, values in arrays.items() if not np.isfinite(values).all())
    name = next(spoilt, None)
    return None if name is None else DivergedError(name.lstrip("/"), training.step)
