"""What it costs that several things share few cores: drawing beside training, and seeds beside each other."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

from benchmarks.speed.contest import Contestant, loaded, ours
from labels_db.presets import preset_named
from trainer.threads import rest_between_clips, threads_of, wait_asleep

ROUNDS = 3
PAIRS = 140


def shared_cores() -> dict[str, Callable[[], dict[str, Any]]]:
    """Rows of the table by name, to be measured; `best_peer` is what there is without sharing."""
    rows = {
        f"training walker-walk, {{}} profile, while {PAIRS} pairs are drawn": _while_drawing,
        "two seeds of walker-walk, {} profile, at once, one thread each": _at_once,
    }
    return {
        (name := words.format(profile)): partial(measure, name, profile)
        for words, measure in rows.items()
        for profile in ("laptop", "paper")
    }


def _while_drawing(name: str, profile: str) -> dict[str, Any]:
    measured = _alone_and_while_drawing(profile)
    return _row(name, measured, peer="nothing drawn", reach="≥ 0.75 × its rate alone")


def _at_once(name: str, profile: str) -> dict[str, Any]:
    measured = [_together_and_apart(profile) for _ in range(2)]
    return _row(name, measured, peer="one after the other, two threads", reach="the faster of both")


def _row(name: str, measured: list[tuple[float, float]], *, peer: str, reach: str) -> dict[str, Any]:
    """From pairs of what sharing brings and what its absence does, in steps a second."""
    shared, alone = (statistics.median(rates) for rates in zip(*measured, strict=True))
    return {
        "name": name,
        "unit": "steps/s",
        "ours": float(f"{shared:.4g}"),
        "best_peer": float(f"{alone:.4g}"),
        "ratio": round(statistics.median(mine / theirs for mine, theirs in measured), 2),
        "limit_fraction": None,
        "peer": peer,
        "reach": reach,
        "all": {"measured": measured},
    }


# Drawing -----------------------------------------------------------------------------------------


def _alone_and_while_drawing(profile: str) -> list[tuple[float, float]]:
    """In a process of its own, since a training has threads and settings of its own."""
    command = [sys.executable, "-m", "benchmarks.speed.sharing", profile]
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    return [(float(drawing), float(alone)) for alone, drawing in map(str.split, lines)]


def _train_and_draw(profile: str) -> None:
    """Print steps a second alone, and while a round's share of the clips is drawn, in turns; threads as a run's own."""
    chosen = preset_named("walker-walk").config(profile)
    wait_asleep(chosen)
    from benchmarks.speed.loop import Stepper
    from trainer.arithmetic import set_up_arithmetic
    from trainer.episodes import EpisodePool
    from trainer.rendering import Renderer
    from trainer.segments import one_by_one

    set_up_arithmetic(threads_of(chosen))
    stepper = Stepper("walker-walk", exploring=False, profile=profile)
    config, pool = stepper.training.config, stepper.training.collector.pool
    assert isinstance(pool, EpisodePool)
    states = one_by_one(pool.episodes[0].states)
    length = round(1 / stepper.training.collector.environments[0].control_step)
    with Renderer(config.environment, config.clips, rest=rest_between_clips(chosen)) as renderer:
        renderer.clip(0, states[:length], 1 / length).result()
        for _ in range(ROUNDS):
            alone = _rate(stepper, partial(_later, time.perf_counter() + 5))
            starts = [index % (len(states) - length) for index in range(2 * PAIRS // ROUNDS)]
            clips = [renderer.clip(0, states[at : at + length], 1 / length) for at in starts]
            print(alone, _rate(stepper, clips[-1].done), flush=True)


def _later(moment: float) -> bool:
    return time.perf_counter() > moment


def _rate(stepper: Callable[[], None], over: Callable[[], bool]) -> float:
    """Steps a second until something is over."""
    began, steps = time.perf_counter(), 0
    while not over():
        stepper()
        steps += 1
    return steps / (time.perf_counter() - began)


# Seeds -------------------------------------------------------------------------------------------


def _together_and_apart(profile: str) -> tuple[float, float]:
    """Steps a second of two seeds together: as two processes of one thread, and one after the other with two."""
    cores = sorted(os.sched_getaffinity(0))[:2]
    steps = 400 if profile == "laptop" else 40
    settings = {"preset": "walker-walk", "exploring": False, "profile": profile}
    together = _steps_per_second([(ours("loop", 1, **settings), [core]) for core in cores], steps)
    return together, _steps_per_second([(ours("loop", 2, **settings), cores)], steps)


def _steps_per_second(commands: Sequence[tuple[list[str], list[int]]], steps: int) -> float:
    """Of all contestants together, each kept to its cores."""
    with loaded(commands) as running, ThreadPoolExecutor(len(commands)) as pool:
        list(pool.map(partial(_seconds, 10), running))  # to warm up
        return sum(steps / seconds for seconds in pool.map(partial(_seconds, steps), running))


def _seconds(units: int, contestant: Contestant) -> float:
    return contestant.seconds(units)


if __name__ == "__main__":
    _train_and_draw(sys.argv[1])
