"""What is known of every environment without a simulator (`catalogue.json`, written by the trainer)."""

from __future__ import annotations

import difflib
import functools
import json
from dataclasses import dataclass
from importlib import resources


@dataclass(frozen=True)
class CatalogueEntry:
    """An environment: sizes of its flat observation and action, time in seconds, what it asks for."""

    name: str
    title: str
    observation_size: int
    action_size: int
    state_size: int
    control_step: float
    episode_steps: int
    goal: str


@functools.cache
def catalogue() -> dict[str, CatalogueEntry]:
    """Every environment by name, as in `dmc:walker-walk`."""
    text = resources.files("labels_db").joinpath("catalogue.json").read_text(encoding="utf-8")
    return {row["name"]: CatalogueEntry(**row) for row in json.loads(text)}


def entry(name: str) -> CatalogueEntry:
    """The entry of that name; ValueError names the closest ones."""
    known = catalogue()
    if name not in known:
        close = difflib.get_close_matches(name, known, n=3) or sorted(known)[:3]
        raise ValueError(f"environment {name!r}: unknown; did you mean {', '.join(close)}?")
    return known[name]
