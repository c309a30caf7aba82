"""Starting a rendering process and talking to it."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from contextlib import suppress
from types import MappingProxyType
from typing import IO

from labels_db.catalogue import included
from labels_db.run_config import Clips, DMControl, EnvironmentConfig
from trainer.rendering.errors import RenderingUnavailable
from trainer.rendering.messages import Header, receive, send

BACKENDS = ("egl", "osmesa")
# One core is enough for a clip in a third of a second, and the other cores are the training's.
ONE_CORE = MappingProxyType({"LP_NUM_THREADS": "0", "OPENBLAS_NUM_THREADS": "1"})
GRACE_SECONDS = 5.0
START_SECONDS = 120.0
"""Longer than any process takes to a first frame."""
LOG_TAIL = 500


class ChildProcess:
    """One rendering process, with one backend."""

    def __init__(self, backend: str, environment: EnvironmentConfig, clips: Clips, rest: float) -> None:
        self.backend = backend
        self._log: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 - as long as the process
        self._process = subprocess.Popen(
            [sys.executable, "-m", "trainer.rendering.child", str(os.getpid())],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            start_new_session=True,  # Ctrl-C in the terminal is the run's business
            env={**ONE_CORE, **os.environ, "MUJOCO_GL": backend, "PYOPENGL_PLATFORM": backend},
        )
        catalogues = [str(path) for path in included()]
        settings = {"environment": environment.model_dump(), "clips": clips.model_dump()}
        self.send({**settings, "catalogues": catalogues, "rest": rest})

    def send(self, header: Header, body: bytes = b"") -> None:
        """Hand over a message; one that a dead process cannot take is sent again to its successor."""
        assert self._process.stdin is not None
        with suppress(OSError):
            send(self._process.stdin, header, body)

    def receive(self) -> tuple[Header, bytes] | None:
        """The next message; None once the process is gone."""
        assert self._process.stdout is not None
        return receive(self._process.stdout)

    def first(self) -> tuple[Header, bytes] | None:
        """The first message, which a driver that hangs is not waited for long."""
        hangs = threading.Timer(START_SECONDS, self.kill)
        hangs.daemon = True
        hangs.start()
        try:
            return self.receive()
        finally:
            hangs.cancel()

    def kill(self) -> None:
        """End the process at once."""
        self._process.kill()

    def leave(self) -> None:
        """Have the process end: by itself, since its input ends, or by force."""
        assert self._process.stdin is not None
        with suppress(OSError):
            self._process.stdin.close()
        try:
            self._process.wait(GRACE_SECONDS)
        except subprocess.TimeoutExpired:
            self._process.kill()

    def close(self) -> str:
        """End the process; how it ended, with the last it wrote."""
        self.leave()
        code = self._process.wait()
        assert self._process.stdout is not None
        self._process.stdout.close()
        with self._log:
            self._log.seek(0)
            words = self._log.read().decode("utf-8", "replace").strip()[-LOG_TAIL:]
        return f"ended with code {code}" + (f": {words}" if words else "")


def start_child(
    environment: EnvironmentConfig,
    clips: Clips,
    backends: tuple[str, ...] = BACKENDS,
    begun: Callable[[ChildProcess], None] = lambda _child: None,
    rest: float = 0.0,
) -> ChildProcess:
    """A process that has drawn a first frame, with the first backend that can; each is `begun` before it has.

    Raises `RenderingUnavailable`, with each backend's reason, where none can.
    """
    reasons: dict[str, str] = {}
    for backend in backends:
        child = ChildProcess(backend, environment, clips, rest)
        begun(child)
        message = child.first()
        if message is not None and "ready" in message[0]:
            return child
        ending = child.close()
        reasons[backend] = ending if message is None else str(message[0]["failed"])
    raise RenderingUnavailable(reasons)


def check_rendering(backends: tuple[str, ...] = BACKENDS) -> str:
    """Draw a frame in a process of its own; the backend that did it, or `RenderingUnavailable`."""
    child = start_child(DMControl(task="cartpole-swingup"), Clips(), backends)
    child.close()
    return child.backend
