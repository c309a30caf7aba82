"""Pictures of several panels: made, refused where they would be empty, and saved."""

from __future__ import annotations

from pathlib import Path
from typing import Any

ACROSS = 3
DPI = 150


def panels(count: int) -> list[Any]:
    from matplotlib import pyplot

    across = min(count, ACROSS)
    down = -(-count // across)
    _, grid = pyplot.subplots(
        down, across, figsize=(4.6 * across, 3.6 * down), squeeze=False, sharey=True, layout="constrained"
    )
    panels = list(grid.flat)
    for unused in panels[count:]:
        unused.remove()
    for axes in panels[:count]:
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(alpha=0.25)
    return panels[:count]


def saved(figure: Any, path: Path) -> Path:
    from matplotlib import pyplot

    figure.savefig(path, dpi=DPI)
    pyplot.close(figure)
    return path


def refuse_nothing(panels: list[Any], file: str, measure: str) -> None:
    """ValueError instead of an empty picture."""
    if not any(map(labelled, panels)):
        raise ValueError(f"{file}: no run has an evaluation with the measure {measure!r} yet")


def labelled(axes: Any) -> bool:
    return bool(axes.get_legend_handles_labels()[0])
