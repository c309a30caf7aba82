"""Clips and videos, made by a rendering process that is brought back when it dies."""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType, TracebackType
from typing import Any, TypeVar

import numpy as np

from labels_db.run_config import Clips, EnvironmentConfig
from trainer.environments import PhysicsState
from trainer.rendering.errors import RenderingError, RenderingLost
from trainer.rendering.messages import Header
from trainer.rendering.process import BACKENDS, ChildProcess, start_child
from trainer.rendering.sheet import EncodedClip

MAX_RESTARTS = 3
CLIP_SECONDS, VIDEO_SECONDS = 120, 600
"""Longer than any takes to draw: an OpenGL driver that hangs must not hang who waits.

Not less for a clip: the largest of Meta-world take 5 s beside two trainings, the first one 7 s, and a machine may be
ten times slower. Whoever gives up too soon takes the rest of a session from the people who would answer it.
"""

T = TypeVar("T")


def drawn(asked: Future[T], seconds: float) -> T:
    """What was asked for, once it is drawn; RenderingLost where a driver hangs."""
    try:
        return asked.result(timeout=seconds)
    except TimeoutError:
        raise RenderingLost(
            f"nothing was drawn within {seconds:.0f} s; `pebble doctor` tells whether this machine can draw"
        ) from None


@dataclass(frozen=True)
class Request:
    """What was asked, kept until it is answered, so that it can be asked again."""

    header: Header
    body: bytes
    future: Future[Any]


def _clip(header: Header, body: bytes) -> EncodedClip:
    facts = header["clip"]
    return EncodedClip(data=body, **{**facts, "times": tuple(facts["times"])})


def _video(header: Header, body: bytes) -> bytes:
    del header
    return body


RESULTS: MappingProxyType[str, Callable[[Header, bytes], Any]] = MappingProxyType(
    {"clip": _clip, "video": _video}
)


class Renderer:
    """Draws one environment's episodes in the background; any thread may ask.

    The process starts with the first request, or with `warm`. A process that dies is started again at most three
    times and asked again for all that is missing; then every future fails with `RenderingLost`. For every second
    of drawing it rests `rest` seconds, which leaves its core to others.
    """

    def __init__(
        self,
        environment: EnvironmentConfig,
        clips: Clips,
        backends: tuple[str, ...] = BACKENDS,
        rest: float = 0.0,
    ) -> None:
        self._start = partial(start_child, environment, clips, backends, self._begun, rest)
        self._lock = threading.Lock()
        self._numbers = itertools.count()
        self._pending: dict[int, Request] = {}
        self._child: ChildProcess | None = None
        self._starting: ChildProcess | None = None
        self._heard = time.monotonic()
        self._keeper: threading.Thread | None = None
        self._over: RenderingError | None = None

    def warm(self) -> None:
        """Have the process start and make ready, so that the first request need not wait for that."""
        with self._lock:
            if self._over is None:
                self._keep()

    def clip(self, episode_seed: int, states: PhysicsState, step_seconds: float) -> Future[EncodedClip]:
        """The sprite sheet of a segment's states [n, S], each lasting `step_seconds`."""
        return self._ask("clip", episode_seed, states, step_seconds)

    def video(self, episode_seed: int, states: PhysicsState, step_seconds: float) -> Future[bytes]:
        """The MP4 of an episode's states [T, S], in real time; waiting clips go first."""
        return self._ask("video", episode_seed, states, step_seconds)

    def close(self) -> None:
        """End the process; what was not drawn by now fails with `RenderingLost`."""
        self._give_up(RenderingLost("rendering: the renderer was closed before this was drawn"))
        if self._keeper is not None:
            self._keeper.join()

    def __enter__(self) -> Renderer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _ask(self, kind: str, episode_seed: int, states: PhysicsState, step_seconds: float) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_running_or_notify_cancel()  # it cannot be cancelled: a request once sent is drawn
        array = np.ascontiguousarray(states, np.float64)
        facts = {"kind": kind, "episode_seed": int(episode_seed), "step_seconds": float(step_seconds)}
        with self._lock:
            if self._over is not None:
                future.set_exception(self._over)
                return future
            self._end_hung()
            number = next(self._numbers)
            header = {**facts, "id": number, "shape": list(array.shape)}
            request = self._pending[number] = Request(header, array.tobytes(), future)
            if self._child is not None:
                self._child.send(request.header, request.body)
            self._keep()
        return future

    def _end_hung(self) -> None:
        """A process that has owed an answer for too long is started again, like one that died."""
        if not self._pending:
            self._heard = time.monotonic()
        kinds = {request.header["kind"] for request in self._pending.values()}
        patience = VIDEO_SECONDS if "video" in kinds else CLIP_SECONDS
        if self._child is not None and time.monotonic() - self._heard > patience:
            self._child.kill()

    def _keep(self) -> None:
        """Start the thread that looks after the process, once."""
        if self._keeper is None:
            self._keeper = threading.Thread(target=self._look_after, name="rendering", daemon=True)
            self._keeper.start()

    def _look_after(self) -> None:
        """Start the process, pass on its answers, and start it again when it dies."""
        try:
            for _ in range(1 + MAX_RESTARTS):
                ending = self._live_once()
                if self._over is not None:
                    return
            self._give_up(
                RenderingLost(
                    f"rendering: the process died {1 + MAX_RESTARTS} times, the last one {ending};"
                    " `pebble doctor` tells whether this machine can draw"
                )
            )
        except RenderingError as error:
            self._give_up(error)
        except Exception as error:  # whatever it is, nobody must wait for a picture forever
            self._give_up(RenderingLost(f"rendering: the process could not be kept ({error!r})"))

    def _live_once(self) -> str:
        """One process from start to end; how it ended."""
        child = self._start()
        with self._lock:
            self._starting, self._heard = None, time.monotonic()
            self._child = None if self._over is not None else child
            for request in self._pending.values():
                child.send(request.header, request.body)
        while self._over is None and (message := child.receive()) is not None:
            self._answer(*message)
        with self._lock:
            self._child = None
        return child.close()

    def _begun(self, child: ChildProcess) -> None:
        """Known before it is ready, so that closing need not wait for one that hangs."""
        with self._lock:
            self._starting = child
            over = self._over is not None
        if over:
            child.leave()

    def _answer(self, header: Header, body: bytes) -> None:
        with self._lock:
            self._heard = time.monotonic()
            request = self._pending.pop(header["id"], None)
        if request is None:
            return
        if "failed" in header:
            kind = request.header["kind"]
            request.future.set_exception(RenderingError(f"rendering a {kind}: {header['failed']}"))
        else:
            request.future.set_result(RESULTS[request.header["kind"]](header, body))

    def _give_up(self, error: RenderingError) -> None:
        """Answer everything, now and later, with this error, and let the process go."""
        with self._lock:
            self._over = self._over or error
            requests, self._pending = list(self._pending.values()), {}
            child, self._child, self._starting = self._child or self._starting, None, None
        for request in requests:
            request.future.set_exception(self._over)
        if child is not None:
            child.leave()
