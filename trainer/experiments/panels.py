"""Pictures of several panels: made, refused where they would be empty, and saved."""

from __future__ import annotations

from pathlib import Path
from typing import Any

ACROSS = 3
DPI = 150


class NothingToShowError(Exception):
    """No run has what the figure is about; the message says what that is."""


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


def refuse_nothing(panels: list[Any], measure: str) -> None:
    """NothingToShowError instead of an empty picture, which is closed."""
    if not any(map(labelled, panels)):
        from matplotlib import pyplot

        pyplot.close(panels[0].figure)
        raise NothingToShowError(f"no run has an evaluation with the measure {measure!r} yet")


def labelled(axes: Any) -> bool:
    return bool(axes.get_legend_handles_labels()[0])
