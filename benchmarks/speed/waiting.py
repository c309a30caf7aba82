"""`python -m benchmarks.speed.waiting`: what a second thread brings, alone and beside another run.

Three minutes, nothing else running. Each measurement is a process of its own, since OpenMP settles when it is loaded.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable

SIZES = ((1024, 1024), (1024, 512), (512, 1024), (512, 512), (256, 256))
ASLEEP, SPINNING = "asleep", "spinning, as OpenMP comes"
WAYS = ((1, "–"), (2, SPINNING), (2, ASLEEP))
WARM_UP, SECONDS = 1.0, 3.0


def main() -> None:
    """Print a Markdown table of updates a second."""
    print("| width, batch | threads | waiting | alone | two at once, each |")
    print("|---|---|---|---|---|")
    for width, batch in SIZES:
        for threads, waiting in WAYS:
            (alone,), together = (rates(n, threads, waiting, width, batch) for n in (1, 2))
            each = sum(together) / len(together)
            print(f"| {width}, {batch} | {threads} | {waiting} | {alone:.4g} | {each:.4g} |", flush=True)


def rates(processes: int, threads: int, waiting: str, width: int, batch: int) -> list[float]:
    """Updates a second of each of so many processes at once."""
    command = [sys.executable, "-m", "benchmarks.speed.waiting", *map(str, (threads, width, batch))]
    said = {"OMP_WAIT_POLICY": "passive"} if waiting == ASLEEP else {}
    started = [
        subprocess.Popen(command, env={**os.environ, **said}, stdout=subprocess.PIPE, text=True)
        for _ in range(processes)
    ]
    return [float(process.communicate()[0]) for process in started]


def measure(threads: int, width: int, batch: int) -> float:
    """Updates a second of one agent."""
    from benchmarks.speed.tasks import sac
    from trainer.arithmetic import set_up_arithmetic

    set_up_arithmetic(threads)
    update = sac(width, batch, "bfloat16")
    _count(update, WARM_UP)
    return _count(update, SECONDS)


def _count(work: Callable[[], object], seconds: float) -> float:
    began, done = time.perf_counter(), 0
    while (passed := time.perf_counter() - began) < seconds:
        work()
        done += 1
    return done / passed


if __name__ == "__main__":
    if len(sys.argv) == 1:
        main()
    else:
        print(measure(*map(int, sys.argv[1:])))
