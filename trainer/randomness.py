"""Every random stream of a run, each by its name, all from one seed.

Streams never share a generator, so that asking people, evaluating or rendering cannot shift what the agent
draws: a run repeats exactly from its seed and its answers.
"""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np
import torch


def derived_seed(seed: int, *path: str | int) -> int:
    """A 31-bit seed for one use, as in `derived_seed(1, "episode", 0, 7)`."""
    text = "/".join(str(part) for part in (seed, *path))
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "big") & 0x7FFF_FFFF


class Randomness:
    """Named generators, made when first asked for; their states are part of a checkpoint."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self._torch: dict[str, torch.Generator] = {}
        self._numpy: dict[str, np.random.Generator] = {}

    def torch(self, name: str, device: torch.device | str = "cpu") -> torch.Generator:
        if name not in self._torch:
            generator = torch.Generator(device)
            generator.manual_seed(derived_seed(self.seed, "torch", name))
            self._torch[name] = generator
        return self._torch[name]

    def numpy(self, name: str) -> np.random.Generator:
        if name not in self._numpy:
            self._numpy[name] = np.random.default_rng(derived_seed(self.seed, "numpy", name))
        return self._numpy[name]

    def state(self) -> dict[str, Any]:
        return {
            "torch": {name: generator.get_state() for name, generator in self._torch.items()},
            "numpy": {name: generator.bit_generator.state for name, generator in self._numpy.items()},
        }

    def load(self, state: dict[str, Any]) -> None:
        """Set the states in place: parts that hold a generator already go on from them.

        A GPU's generators are others than a CPU's: a run that moves between them draws anew from its seed.
        """
        for name, bits in state["torch"].items():
            generator = self.torch(name)
            if len(bits) == len(generator.get_state()):
                generator.set_state(bits)
            else:
                generator.manual_seed(derived_seed(self.seed, "moved", name, sha256(bits)))
        for name, bits in state["numpy"].items():
            self.numpy(name).bit_generator.state = bits


def sha256(bits: torch.Tensor) -> str:
    return hashlib.sha256(bits.numpy().tobytes()).hexdigest()
