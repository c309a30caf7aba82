"""Parts from outside: a configuration names one that is installed, never a module path.

An installed package offers them as entry points of the groups below; see docs/extending.md.
"""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import Any

ENVIRONMENTS = "pebble.environments"
BEHAVIOURS = "pebble.behaviours"
TEACHERS = "pebble.teachers"
SCHEMES = "pebble.schemes"


def installed(group: str, name: str) -> Any:
    """What an installed package offers under that name; ValueError names what there is."""
    offered = {point.name: point for point in entry_points(group=group)}
    if name not in offered:
        there = ", ".join(sorted(offered)) or "none is installed"
        raise ValueError(f"{group} {name!r}: no installed package offers it; there is: {there}")
    return offered[name].load()
