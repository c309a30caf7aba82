"""One of our tasks as a contestant: `python -m benchmarks.speed.worker TASK THREADS SETTINGS`."""

from __future__ import annotations

import json
import os
import sys
import time


def main() -> None:
    task, threads, settings = sys.argv[1], int(sys.argv[2]), json.loads(sys.argv[3])
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:threads])
    os.environ.setdefault("MUJOCO_GL", "egl")
    from benchmarks.speed.tasks import TASKS
    from trainer.arithmetic import set_up_arithmetic

    set_up_arithmetic(threads)
    work = TASKS[task](**settings)
    print("ready", flush=True)
    for line in sys.stdin:
        began = time.perf_counter()
        for _ in range(int(line)):
            work()
        print(time.perf_counter() - began, flush=True)


if __name__ == "__main__":
    main()
