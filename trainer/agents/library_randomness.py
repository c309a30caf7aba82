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

    def __init__(self, seed: int, name: str, device: torch.device) -> None:
        self._device = device
        drawn = derived_seed(seed, "library torch", name)
        self._ours: dict[str, Any] = {
            "numpy": np.random.RandomState(derived_seed(seed, "library", name)).get_state(legacy=False),
            "torch": torch.Generator().manual_seed(drawn).get_state(),
        }
        if device.type == "cuda":
            self._ours["cuda"] = torch.Generator(device).manual_seed(drawn).get_state()

    @contextmanager
    def __call__(self) -> Iterator[None]:
        theirs = self._leave()
        self._enter(self._ours)
        try:
            yield
        finally:
            self._ours = self._leave()
            self._enter(theirs)

    def _leave(self) -> dict[str, Any]:
        """Where the global generators stand."""
        states = {"numpy": np.random.get_state(legacy=False), "torch": torch.get_rng_state()}
        if self._device.type == "cuda":
            states["cuda"] = torch.cuda.get_rng_state(self._device)
        return states

    def _enter(self, states: dict[str, Any]) -> None:
        np.random.set_state(states["numpy"])
        torch.set_rng_state(states["torch"])
        if self._device.type == "cuda":
            torch.cuda.set_rng_state(states["cuda"], self._device)

    def state(self) -> dict[str, Any]:
        return self._ours

    def load(self, state: dict[str, Any]) -> None:
        """Go on from there; a generator that the other device did not have begins anew."""
        self._ours = {name: state.get(name, mine) for name, mine in self._ours.items()}
