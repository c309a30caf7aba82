"""Sprite sheets: the frames of a clip in one WebP, with the time each is shown at."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt
from PIL import Image, WebPImagePlugin

Frame = npt.NDArray[np.uint8]

WEBP = WebPImagePlugin.WebPImageFile.format  # asked for by import, or Pillow would load all its formats
MAX_BYTES = 150_000  # for frames of 320 × 240 or smaller; larger ones weigh more in proportion
# WebP's quality, best first, and what a sheet then weighs in parts of what it weighs in the best.
QUALITIES = MappingProxyType({80: 1.0, 70: 0.80, 62: 0.72, 46: 0.60, 30: 0.46, 14: 0.31, 6: 0.24})


@dataclass(frozen=True)
class EncodedClip:
    """A WebP of `rows` × `columns` frames, each `width` × `height` pixels, read left to right."""

    data: bytes
    frames: int
    rows: int
    columns: int
    width: int
    height: int
    duration: float
    times: tuple[float, ...]
    """Seconds from the clip's start at which each frame appears; the last stays until `duration`."""


def chosen_steps(steps: int) -> list[int]:
    """Which of a segment's steps become frames: 20 to 30 of them, evenly spaced where that is possible."""
    divisors = [count for count in range(20, 31) if steps % count == 0]
    nearest = min(divisors, key=lambda count: abs(count - 25), default=min(steps, 25))
    return [round(index * steps / nearest) for index in range(nearest)]


def grid(frames: int) -> tuple[int, int]:
    """(rows, columns) of a sheet, about as many of one as of the other."""
    columns = math.ceil(math.sqrt(frames))
    return math.ceil(frames / columns), columns


def encode_clip(frames: Sequence[Frame], times: tuple[float, ...], duration: float) -> EncodedClip:
    """The sheet of frames [height, width, 3], in the best quality that is light enough."""
    height, width, _ = frames[0].shape
    rows, columns = grid(len(frames))
    data = _encode(_tile(frames, rows, columns), allowed_bytes(width, height))
    return EncodedClip(data, len(frames), rows, columns, width, height, duration, times)


def verify_clip(clip: EncodedClip) -> None:
    """Decode the sheet; ValueError where it is no WebP of the size it claims."""
    expected = (clip.columns * clip.width, clip.rows * clip.height)
    try:
        with Image.open(io.BytesIO(clip.data), formats=[WEBP]) as image:
            image.load()
            size = image.size
    except (OSError, SyntaxError) as error:
        raise ValueError(
            f"clip of {len(clip.data)} bytes: not a readable WebP ({error}); render it again"
        ) from error
    if size != expected:
        raise ValueError(f"clip: the sheet is {size} pixels, not {expected}; render it again")


def allowed_bytes(width: int, height: int) -> int:
    """How much a sheet of frames of that size may weigh."""
    return round(MAX_BYTES * max(1.0, width * height / (320 * 240)))


def _tile(frames: Sequence[Frame], rows: int, columns: int) -> Frame:
    height, width, _ = frames[0].shape
    sheet = np.zeros((rows * height, columns * width, 3), np.uint8)
    for index, frame in enumerate(frames):
        top, left = (index // columns) * height, (index % columns) * width
        sheet[top : top + height, left : left + width] = frame
    return sheet


def _encode(sheet: Frame, allowed: int) -> bytes:
    """The WebP of a sheet, skipping what cannot be light enough; the lightest where nothing is."""
    image = Image.fromarray(sheet)
    best = data = _webp(image, max(QUALITIES))
    for quality, share in QUALITIES.items():
        if len(data) <= allowed:
            break
        if share * len(best) <= allowed or quality == min(QUALITIES):
            data = _webp(image, quality)
    return data


def _webp(image: Image.Image, quality: int) -> bytes:
    buffer = io.BytesIO()
    image.save(buffer, WEBP, quality=quality, method=0)
    return buffer.getvalue()
