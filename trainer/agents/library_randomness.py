"""Chance for libraries that draw from the global generators of NumPy and PyTorch."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import torch

from trainer.randomness import derived_seed


class LibraryRandomness:
    """Global generators that are ours for a while: `with luck():` goes on where the last time ended."""

    def __init__(self, seed: int, name: str) -> None:
        self._numpy = np.random.RandomState(derived_seed(seed, "library", name)).get_state(legacy=False)
        self._torch = torch.Generator().manual_seed(derived_seed(seed, "library torch", name)).get_state()

    @contextmanager
    def __call__(self) -> Iterator[None]:
        theirs = np.random.get_state(legacy=False), torch.get_rng_state()
        self._enter(self._numpy, self._torch)
        try:
            yield
        finally:
            self._numpy, self._torch = np.random.get_state(legacy=False), torch.get_rng_state()
            self._enter(*theirs)

    def _enter(self, numpy: Any, torch_state: torch.Tensor) -> None:
        np.random.set_state(numpy)
        torch.set_rng_state(torch_state)

    def state(self) -> dict[str, Any]:
        return {"numpy": self._numpy, "torch": self._torch}

    def load(self, state: dict[str, Any]) -> None:
        self._numpy, self._torch = state["numpy"], state["torch"]
