"""`python -m benchmarks.laptop [--data DIR] [--seeds N]`: the sweep, its picture and its table.

The folder holds a file for each run. Runs that it holds are not lived again, so it may be killed and started as
often as one likes.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

from benchmarks.laptop.variations import TASKS, VARIATIONS

RESULTS = Path(__file__).parent.parent / "results"
LAST = 3
"""Evaluations at the end whose mean is a run's result: single ones jump."""


def lived(folder: Path, task: str, variation: str, seed: int) -> dict[str, Any]:
    """The run's result, from the folder if it is there."""
    file = folder / f"{task} {variation} {seed}.json".replace(" ", "_").replace(",", "")
    if not file.exists():
        command = [sys.executable, "-m", "benchmarks.laptop.live", task, variation, str(seed), str(file)]
        subprocess.run(command, check=True)
    found: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return found


def result(run: dict[str, Any]) -> float:
    return float(np.mean([np.mean(point["returns"]) for point in run["curve"][-LAST:]]))


def whole(run: dict[str, Any]) -> float:
    """The mean over all evaluations: how early it learned."""
    return float(np.mean([np.mean(point["returns"]) for point in run["curve"]]))


def table(runs: list[dict[str, Any]]) -> str:
    """A line for each variation, in Markdown."""
    grouped = defaultdict(list)
    for run in runs:
        grouped[run["variation"], run["task"]].append(run)
    head = [f"{task}: last three minutes | mean of all ten | steps" for task in TASKS]
    lines = ["| variation | " + " | ".join(head) + " |", "|---" * (1 + 3 * len(TASKS)) + "|"]
    for variation in VARIATIONS:
        cells = [
            f"{np.mean([result(run) for run in group]):.0f} | {np.mean([whole(run) for run in group]):.0f}"
            f" | {np.mean([run['curve'][-1]['step'] for run in group]):,.0f}"
            for group in (grouped[variation, task] for task in TASKS)
            if group
        ]
        lines.append(f"| {variation} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def plot(runs: list[dict[str, Any]]) -> None:
    """Return against minutes, a panel for each task."""
    mpl.use("Agg")
    from matplotlib import pyplot

    figure, panels = pyplot.subplots(1, len(TASKS), figsize=(11, 4.5), layout="constrained")
    colours = pyplot.get_cmap("tab20")
    for axes, task in zip(panels, TASKS, strict=True):
        for number, variation in enumerate(VARIATIONS):
            curves = [r["curve"] for r in runs if (r["task"], r["variation"]) == (task, variation)]
            minutes = [point["seconds"] / 60 for point in curves[0]]
            means = np.mean([[np.mean(point["returns"]) for point in curve] for curve in curves], 0)
            axes.plot(minutes, means, label=variation, linewidth=1.5, color=colours(number))
        axes.set(title=task, xlabel="minutes of one core", ylabel="true return")
    panels[-1].legend(fontsize=8)
    figure.savefig(RESULTS / "laptop.png", dpi=120)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=RESULTS / "laptop")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--parallel", type=int, default=2)
    chosen = parser.parse_args()
    chosen.data.mkdir(parents=True, exist_ok=True)
    wanted = [(t, v, s) for s in range(1, chosen.seeds + 1) for v in VARIATIONS for t in TASKS]
    with ThreadPoolExecutor(chosen.parallel) as pool:
        runs = list(pool.map(lambda run: lived(chosen.data, *run), wanted))
    plot(runs)
    print(table(runs))


if __name__ == "__main__":
    main()
