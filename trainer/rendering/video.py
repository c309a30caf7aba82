"""Videos: an episode as MP4 that any browser plays and seeks in."""

from __future__ import annotations

import math
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from types import TracebackType

import av

from trainer.rendering.sheet import Frame

MAX_FRAMES_PER_SECOND = 30


def stride(step_seconds: float) -> int:
    """Show every n-th step, so that real time needs at most 30 frames a second."""
    return max(1, math.ceil(1 / (MAX_FRAMES_PER_SECOND * step_seconds) - 1e-9))


def frame_rate(step_seconds: float) -> Fraction:
    """Frames a second at which every `stride`-th step plays in real time."""
    return 1 / (Fraction(step_seconds).limit_denominator(10_000) * stride(step_seconds))


def even(pixels: int) -> int:
    """The size yuv420p needs: its colours come in pairs of pixels."""
    return pixels - pixels % 2


class VideoFile:
    """An MP4 being written, frame by frame; a file, since `faststart` goes back to its beginning."""

    def __init__(self, path: Path, rate: Fraction, width: int, height: int) -> None:
        self._width, self._height = even(width), even(height)
        self._container = av.open(str(path), "w", format="mp4", options={"movflags": "+faststart"})
        self._stream = self._container.add_stream("libx264", rate=rate, options={"preset": "veryfast"})
        self._stream.width, self._stream.height = self._width, self._height
        self._stream.pix_fmt = "yuv420p"

    def write(self, frame: Frame) -> None:
        """Add a frame [height, width, 3]."""
        picture = av.VideoFrame.from_ndarray(frame[: self._height, : self._width].copy(), format="rgb24")
        self._container.mux(self._stream.encode(picture))

    def __enter__(self) -> VideoFile:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        del error, trace
        if kind is None:
            self._container.mux(self._stream.encode(None))
        self._container.close()


def encoding(
    frames: Iterator[Frame], path: Path, step_seconds: float, width: int, height: int
) -> Iterator[None]:
    """Write the frames, giving way after each one."""
    with VideoFile(path, frame_rate(step_seconds), width, height) as video:
        for frame in frames:
            video.write(frame)
            yield
