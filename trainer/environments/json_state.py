"""Arrays and numpy's legacy generator as JSON, exactly."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import numpy.typing as npt


def array_to_json(array: npt.NDArray[Any]) -> dict[str, str]:
    """A flat array [N] as JSON, its bytes in base64."""
    return {"dtype": array.dtype.str, "base64": base64.b64encode(array.tobytes()).decode("ascii")}


def array_from_json(value: dict[str, str]) -> npt.NDArray[Any]:
    """The array [N] that `array_to_json` wrote."""
    return np.frombuffer(base64.b64decode(value["base64"]), dtype=np.dtype(value["dtype"])).copy()


def random_to_json(random: np.random.RandomState) -> dict[str, Any]:
    """The generator's state: 624 keys, the place among them, and the second normal of a pair if kept."""
    state: dict[str, Any] = random.get_state(legacy=False)
    keys, position = state["state"]["key"], state["state"]["pos"]
    return {
        "keys": array_to_json(keys),
        "position": int(position),
        "has_normal": int(state["has_gauss"]),
        "normal": float(state["gauss"]),
    }


def random_from_json(random: np.random.RandomState, state: dict[str, Any]) -> None:
    """Set the generator to what `random_to_json` wrote."""
    keys = array_from_json(state["keys"])
    random.set_state(("MT19937", keys, state["position"], state["has_normal"], state["normal"]))


def seed_random(random: np.random.RandomState, seed: int) -> None:
    """Set the generator to the one start that belongs to `seed`, any integer ≥ 0."""
    bits = np.random.MT19937(np.random.SeedSequence(seed))
    random.set_state(np.random.RandomState(bits).get_state())
