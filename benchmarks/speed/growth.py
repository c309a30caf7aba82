"""How the parts of the loop that grow with a run cost more as it goes on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.speed.contest import loaded, ours

SIZES: dict[str, tuple[str, str, list[int]]] = {
    # what: (task, its argument, sizes)
    "intrinsic reward, batch 1024, D 24, by states": (
        "neighbours",
        "count",
        [1_000, 10_000, 100_000, 500_000],
    ),
    "relabelling, by rows": ("relabel", "rows", [1_000, 10_000, 100_000, 500_000]),
    "one epoch of a fit, by labels of 2 × 50 steps": ("fit", "labels", [20, 100, 350, 1400]),
    "selection by entropy, by pairs kept of ten times as many": ("choose", "count", [10, 40, 140, 400]),
}
FIXED: dict[str, dict[str, int]] = {"neighbours": {"size": 24}}


def growth() -> list[dict[str, Any]]:
    """Seconds at each size, the better of two."""
    return [{"name": name, "seconds": _measured(*sizes)} for name, sizes in SIZES.items()]


def _measured(task: str, argument: str, sizes: list[int]) -> dict[int, float]:
    commands = [ours(task, 2, **{argument: size}, **FIXED.get(task, {})) for size in sizes]
    with loaded((command, None) for command in commands) as running:
        return {
            size: round(min(contestant.seconds(1) for _ in range(2)), 5)
            for size, contestant in zip(sizes, running, strict=True)
        }


def plot(curves: list[dict[str, Any]], path: Path) -> None:
    """Seconds against size, both as logarithms."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(7, 4), layout="constrained")
    for curve in curves:
        sizes = [float(size) for size in curve["seconds"]]
        axes.plot(sizes, list(curve["seconds"].values()), marker="o", label=curve["name"])
    axes.set(xscale="log", yscale="log", xlabel="size", ylabel="seconds, two cores, float32")
    figure.legend(fontsize=8, loc="outside upper center", ncols=2)
    figure.savefig(path, dpi=120)
