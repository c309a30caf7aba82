"""Contestants in processes of their own that take turns, so that a drifting machine treats all alike."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
REST = 0.3
"""Seconds before a turn: idle threads of OpenMP and of JAX go on spinning for 0.2 s, on the next one's cores."""


class Contestant:
    """A process that answers each line N with the seconds that N units of its work took, on some cores or all.

    It starts to load at once, so that several can do so side by side.
    """

    def __init__(self, command: Sequence[str], cores: Sequence[int] | None = None) -> None:
        self.command = command
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        if cores is not None:
            os.sched_setaffinity(self._process.pid, cores)

    def seconds(self, units: int) -> float:
        assert self._process.stdin is not None
        time.sleep(REST)
        self._process.stdin.write(f"{units}\n")
        self._process.stdin.flush()
        return float(self._read())

    def _read(self) -> str:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            assert self._process.stderr is not None
            raise RuntimeError(f"{' '.join(self.command)} ended: {self._process.stderr.read()[-2000:]}")
        return line.strip()

    def wait_until_ready(self) -> None:
        while (line := self._read()) != "ready":
            del line  # what a library prints while it is imported

    def end(self) -> None:
        self._process.kill()
        self._process.communicate()


def ours(task: str, threads: int, **settings: Any) -> list[str]:
    """A contestant from `tasks.py`."""
    return [sys.executable, "-m", "benchmarks.speed.worker", task, str(threads), json.dumps(settings)]


def peer(python: Path, name: str, threads: int, width: int, batch: int) -> list[str]:
    """A contestant from another library."""
    return [str(python), "-P", str(HERE / "peers.py"), name, str(threads), str(width), str(batch)]


@dataclass(frozen=True)
class Speeds:
    """Units per second of each contestant, one number a round."""

    rounds: Mapping[str, list[float]]

    def median(self, name: str) -> float:
        return statistics.median(self.rounds[name])

    def ratio(self, name: str, other: str) -> float:
        """The median over rounds: within one the machine was the same for both."""
        pairs = zip(self.rounds[name], self.rounds[other], strict=True)
        return statistics.median(mine / theirs for mine, theirs in pairs)

    def spread(self, name: str) -> tuple[float, float]:
        return min(self.rounds[name]), max(self.rounds[name])


def contest(contestants: Mapping[str, Sequence[str]], *, rounds: int = 5, seconds: float = 0.5) -> Speeds:
    """Each contestant in turn, for about so many seconds a turn, after one turn to warm up."""
    speeds: dict[str, list[float]] = {name: [] for name in contestants}
    with loaded((command, None) for command in contestants.values()) as started:
        running = dict(zip(contestants, started, strict=True))
        units = {name: _units(contestant, seconds) for name, contestant in running.items()}
        for _ in range(rounds):
            for name, contestant in running.items():
                speeds[name].append(units[name] / contestant.seconds(units[name]))
    return Speeds(speeds)


@contextmanager
def loaded(commands: Iterable[tuple[Sequence[str], Sequence[int] | None]]) -> Iterator[list[Contestant]]:
    """Contestants, each on its cores or all, that have loaded side by side and now wait for their turns."""
    with ExitStack() as stack:
        loading = [Contestant(command, cores) for command, cores in commands]
        for contestant in loading:
            stack.callback(contestant.end)
        for contestant in loading:
            contestant.wait_until_ready()
        yield loading


def _units(contestant: Contestant, seconds: float) -> int:
    """How many units a turn has; who is slow has warmed up by showing it."""
    first = contestant.seconds(1)
    return 1 if first > 2 * seconds else max(1, round(seconds / contestant.seconds(1)))
