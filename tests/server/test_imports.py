"""The server starts without the trainer's world."""

from __future__ import annotations

import subprocess
import sys

SCRIPT = """
import sys
import server.app, server.serve
heavy = {"torch", "mujoco", "numpy", "dm_control", "trainer"} & set(sys.modules)
sys.exit(", ".join(sorted(heavy)) or 0)
"""


def test_importing_the_server_brings_nothing_heavy() -> None:
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
