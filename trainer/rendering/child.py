"""The rendering process: `python -m trainer.rendering.child <parent's id>`.

Requests come in on standard input, replies go out on what was standard output; MUJOCO_GL is set by
the parent. Clips go before videos, and a video gives way after each frame.
"""

from __future__ import annotations

import importlib.util
import itertools
import os
import queue
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, TypeAlias

import numpy as np
from pydantic import TypeAdapter

from labels_db.catalogue import include
from labels_db.run_config import Clips, EnvironmentConfig
from trainer.environments import PhysicsState, make_environment
from trainer.rendering.messages import Header, receive, send
from trainer.rendering.sheet import Frame, chosen_steps, encode_clip

if TYPE_CHECKING:
    from trainer.rendering.painter import Painter
    from trainer.rendering.pictured import PicturePainter

WATCH_SECONDS = 1.0
LEAVING = -1  # before every request

Work = Iterator[None]
AnyPainter: TypeAlias = "Painter | PicturePainter"


class Workshop:
    """Carries out requests, each a generator that gives way after a frame or at its end.

    For every second of work it rests `rest` seconds.
    """

    def __init__(
        self, painter: AnyPainter, clips: Clips, answer: Callable[[Header, bytes], None], rest: float
    ) -> None:
        self._painter, self._clips, self._answer, self._rest = painter, clips, answer, rest
        self._waiting: queue.PriorityQueue[tuple[int, int, Header, Work]] = queue.PriorityQueue()
        self._arrivals = itertools.count()

    def take(self, header: Header, body: bytes) -> None:
        """Put a request in its place: clips before videos, earlier ones first."""
        rank, work = WORK[header["kind"]]
        states = np.frombuffer(body, np.float64).reshape(header["shape"])
        self._waiting.put((rank, next(self._arrivals), header, work(self, header, states)))

    def leave(self) -> None:
        """Stop before the next stretch of work."""
        self._waiting.put((LEAVING, next(self._arrivals), {}, iter(())))

    def work(self) -> bool:
        """Do one stretch of the most urgent request; false once it is time to leave."""
        rank, arrival, header, work = self._waiting.get()
        began = time.monotonic()
        try:
            next(work)
            self._waiting.put((rank, arrival, header, work))
        except StopIteration:
            pass
        except Exception as error:  # the request's own fault: only its future fails
            self._answer({"id": header["id"], "failed": f"{type(error).__name__}: {error}"}, b"")
        time.sleep(self._rest * (time.monotonic() - began))
        return rank != LEAVING

    def clip(self, header: Header, states: PhysicsState) -> Work:
        """Draw some of the states [H, S] and answer with their sprite sheet."""
        steps, seconds = chosen_steps(len(states)), header["step_seconds"]
        frames = list(self._frames(header, states, steps))
        clip = encode_clip(frames, tuple(step * seconds for step in steps), len(states) * seconds)
        facts = asdict(clip)
        data = facts.pop("data")
        self._answer({"id": header["id"], "clip": facts}, data)
        yield from ()

    def video(self, header: Header, states: PhysicsState) -> Work:
        """Draw an episode's states [T, S] in real time and answer with an MP4."""
        from trainer.rendering.video import encoding, stride  # loads FFmpeg, which clips do without

        seconds, size = header["step_seconds"], (self._clips.width, self._clips.height)
        frames = self._frames(header, states, range(0, len(states), stride(seconds)))
        with tempfile.TemporaryDirectory(prefix="pebble-video-") as folder:
            path = Path(folder) / "video.mp4"
            yield from encoding(frames, path, seconds, *size)
            self._answer({"id": header["id"]}, path.read_bytes())

    def _frames(self, header: Header, states: PhysicsState, steps: Any) -> Iterator[Frame]:
        return (self._painter.draw(header["episode_seed"], states[step]) for step in steps)


WORK: dict[str, tuple[int, Callable[[Workshop, Header, PhysicsState], Work]]] = {
    "clip": (0, Workshop.clip),
    "video": (1, Workshop.video),
}


def main() -> None:
    """Say whether drawing works, then draw until the parent is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    requests, replies = private_streams()
    threading.Thread(target=leave_with_parent, args=(int(sys.argv[1]),), daemon=True).start()
    message = receive(requests)
    if message is None:
        return
    settings, _ = message
    clips = Clips.model_validate(settings["clips"])
    try:
        painter = open_painter(settings, clips)
    except Exception as error:
        send(replies, {"failed": f"{type(error).__name__}: {error}"})
        return
    send(replies, {"ready": True})
    workshop = Workshop(painter, clips, lambda header, body: send(replies, header, body), settings["rest"])
    threading.Thread(target=read_requests, args=(requests, workshop), daemon=True).start()
    while workshop.work():
        pass


def private_streams() -> tuple[IO[bytes], IO[bytes]]:
    """Standard input and output for ourselves; whatever a library prints goes to standard error."""
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    return sys.stdin.buffer, replies


def open_painter(settings: Header, clips: Clips) -> AnyPainter:
    """The scene and its OpenGL context, tried on a first frame; raises whatever a missing library raises."""
    from trainer.rendering.painter import Painter
    from trainer.rendering.pictured import PicturePainter

    load_when_used("scipy.ndimage")  # half of the suite's loading, and only quadruped-escape uses it
    for path in settings.get("catalogues", ()):
        include(Path(path))
    config = TypeAdapter[Any](EnvironmentConfig).validate_python(settings["environment"])
    scene: Any = make_environment(config).scene
    painter = (PicturePainter if scene.model is None else Painter)(scene, clips.width, clips.height)
    encode_clip([painter.draw_scene(0)], (0.0,), 0.0)
    return painter


def load_when_used(name: str) -> None:
    """Have a submodule load when something in it is first asked for, not when it is imported."""
    spec = importlib.util.find_spec(name)
    assert spec is not None
    assert spec.loader is not None
    loader = importlib.util.LazyLoader(spec.loader)
    module = importlib.util.module_from_spec(spec)
    loader.exec_module(module)
    package, _, child = name.rpartition(".")
    sys.modules[name] = module
    setattr(sys.modules[package], child, module)  # or `from package import child` would load it


def read_requests(requests: IO[bytes], workshop: Workshop) -> None:
    """Hand on requests until the parent closes the pipe."""
    while (message := receive(requests)) is not None:
        workshop.take(*message)
    workshop.leave()


def leave_with_parent(parent: int) -> None:
    """Leave when the parent has died, even if some other process still holds our pipe open."""
    while os.getppid() == parent:
        time.sleep(WATCH_SECONDS)
    os._exit(0)


if __name__ == "__main__":
    main()
