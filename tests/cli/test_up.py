"""`pebble up` takes its supervisor with it, however it ends."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

SIGNALS = [signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGKILL]


@pytest.mark.parametrize("number", SIGNALS)
def test_ending_it_ends_the_supervisor_too(number: signal.Signals, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "cli", "up", "--port", "0", "--data", str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        assert process.stdout is not None
        said = next(line for line in process.stdout if "ready" in line)
        process.send_signal(number)
        # The supervisor writes to the same pipe, so it is at its end only when both have ended.
        rest, _ = process.communicate(timeout=60)
    assert "http://127.0.0.1" in said
    assert process.returncode == (-number if number == signal.SIGKILL else 0), rest
