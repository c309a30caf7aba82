"""What several tests of the trainer begin with."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trainer.collector import Transitions

Array = NDArray[np.float32]


def lived(
    observations: Array, actions: Array, next_observations: Array, terminated: NDArray[np.bool_]
) -> Transitions:
    """One step of N environments."""
    zeros = np.zeros(len(actions), np.float32)
    return Transitions(
        observations, actions, zeros, next_observations, terminated, ended=terminated, episode_returns=()
    )
