"""Where a step of training spends its time: `python -m benchmarks.speed.step_times [--preset NAME] [--plain]`."""

from __future__ import annotations

import argparse
import cProfile
import pstats
import time
from collections.abc import Mapping
from typing import Any

from benchmarks.speed.loop import Stepper
from trainer.arithmetic import set_up_arithmetic

PARTS: Mapping[str, tuple[str, str]] = {
    # what: (file, function), cumulative and disjoint
    "intrinsic reward": ("exploration.py", "__call__"),
    "the update's rest": ("sac.py", "update"),
    "choosing the action": ("training.py", "choose_actions"),
    "environment and episode": ("collector.py", "step"),
    "reward of the new transition": ("reward_source.py", "of"),
    "remembering it": ("sac.py", "observe"),
}
STEPS = 500


def profile(preset: str, *, exploring: bool, plain: bool) -> dict[str, float]:
    """Milliseconds of one step by part; the profiler's own cost is spread as the parts' calls are."""
    step = Stepper(preset, exploring=exploring, precision="float32" if plain else None, plain=plain)
    began = time.perf_counter()
    _repeat(step)
    whole = 1e3 * (time.perf_counter() - began) / STEPS
    profiler = cProfile.Profile()
    profiler.runcall(_repeat, step)
    measured: Any = pstats.Stats(profiler)  # its numbers are public, but not in its annotations
    found = {
        name: sum(
            row[3]
            for (path, _, called), row in measured.stats.items()
            if path.endswith(file) and called == function
        )
        for name, (file, function) in PARTS.items()
    }
    found["the update's rest"] -= found["intrinsic reward"]
    total = measured.total_tt
    shares = {**found, "everything else": total - sum(found.values())}
    return {"a whole step": whole, **{name: whole * seconds / total for name, seconds in shares.items()}}


def _repeat(step: Stepper) -> None:
    for _ in range(STEPS):
        step()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--preset", default="walker-walk")
    parser.add_argument("--plain", action="store_true", help="under autograd, float32, searching plainly")
    chosen = parser.parse_args()
    set_up_arithmetic(1)
    columns = [profile(chosen.preset, exploring=exploring, plain=chosen.plain) for exploring in (True, False)]
    print("| ms | exploring | training |\n|---|---|---|")
    for name in columns[0]:
        print(f"| {name} | {columns[0][name]:.2f} | {columns[1][name]:.2f} |")


if __name__ == "__main__":
    main()
