"""How long people wait for something to start."""

from __future__ import annotations

import sqlite3
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

PORT = 8917


def up_to_served_page() -> float:
    """Seconds from `pebble up` to the first page that it serves."""
    with tempfile.TemporaryDirectory() as data:
        return _until(["up", "--port", str(PORT), "--data", data], lambda: _served())


def train_to_first_step() -> float:
    """Seconds from `pebble train` to the run's first recorded step."""
    with tempfile.TemporaryDirectory() as data:
        arguments = ["train", "walker-walk", "--json", "--data", data]
        return _until(arguments, lambda: _stepped(Path(data) / "pebble.db"))


def _until(arguments: list[str], ready: Callable[[], bool]) -> float:
    began = time.perf_counter()
    quiet = subprocess.DEVNULL
    process = subprocess.Popen(
        [sys.executable, "-m", "cli", *arguments], stdout=quiet, stderr=quiet, stdin=quiet
    )
    try:
        while not ready():
            assert process.poll() is None, f"pebble {' '.join(arguments)} ended with {process.returncode}"
            time.sleep(0.02)
        return time.perf_counter() - began
    finally:
        process.terminate()
        process.wait()


def _served() -> bool:
    """Whether the page that asks for the token is there: the first that anybody sees."""
    try:
        with urllib.request.urlopen(f"http://127.0.0.1:{PORT}/") as answer:
            return bool(answer.status == 200)
    except urllib.error.HTTPError as refused:
        return refused.headers.get_content_type() == "text/html"
    except (urllib.error.URLError, ConnectionError):
        return False


def _stepped(database: Path) -> bool:
    if not database.exists():
        return False
    try:
        with closing(sqlite3.connect(f"file:{database}?mode=ro", uri=True)) as connection:
            return any(step > 0 for (step,) in connection.execute("SELECT step FROM runs"))
    except sqlite3.Error:
        return False
