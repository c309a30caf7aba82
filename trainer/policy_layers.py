"""A deterministic policy as plain layers, whatever network it was learned with."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]

ACTIVATIONS: Mapping[str, Callable[[Array], Array]] = MappingProxyType(
    {
        "relu": lambda x: np.maximum(x, 0),
        "tanh": np.tanh,
        "clip_1": lambda x: np.clip(x, -1, 1),
        "clip_10": lambda x: np.clip(x, -10, 10),
    }
)


@dataclass(frozen=True)
class PolicyLayer:
    """x [B, in] becomes activation(x · weight [in, out] + bias [out])."""

    weight: Array
    bias: Array
    activation: str

    def __call__(self, x: Array) -> Array:
        return ACTIVATIONS[self.activation](x @ self.weight + self.bias)


def roll_out(layers: Sequence[PolicyLayer], observations: Array) -> Array:
    """Observations [B, D] → actions [B, A]."""
    return reduce(lambda x, layer: layer(x), layers, observations)
