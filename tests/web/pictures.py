"""Small real clips and videos of a pole on a cart, drawn without a simulator."""

from __future__ import annotations

import functools
import io
import math
import struct

import av
from PIL import Image, ImageDraw

WIDTH, HEIGHT = 320, 240
FRAMES, COLUMNS = 25, 5


def frame(angle: float, offset: float = 0.0) -> Image.Image:
    """The cart somewhere on its rail, its pole at that angle from upright."""
    image = Image.linear_gradient("L").resize((WIDTH, HEIGHT)).convert("RGB")
    draw = ImageDraw.Draw(image)
    draw.rectangle((0, 0, WIDTH, HEIGHT), fill=(92, 116, 140))
    draw.rectangle((0, 170, WIDTH, HEIGHT), fill=(58, 72, 88))
    x, y = WIDTH / 2 + offset, 150
    draw.line((20, 158, WIDTH - 20, 158), fill=(30, 36, 44), width=4)
    draw.rounded_rectangle((x - 26, y - 12, x + 26, y + 12), 4, fill=(214, 172, 92))
    tip = (x + 90 * math.sin(angle), y - 90 * math.cos(angle))
    draw.line((x, y, *tip), fill=(236, 220, 180), width=10)
    draw.ellipse((tip[0] - 8, tip[1] - 8, tip[0] + 8, tip[1] + 8), fill=(236, 220, 180))
    return image


def frames(speed: float, phase: float = 0.0, count: int = FRAMES) -> list[Image.Image]:
    """A pole turning at a speed in turns per second, for a second."""
    return [frame(phase + 2 * math.pi * speed * k / FRAMES, 20 * math.sin(k / 4)) for k in range(count)]


@functools.cache
def sheet(speed: float, phase: float = 0.0) -> bytes:
    """The frames in a grid, as WebP."""
    grid = Image.new("RGB", (COLUMNS * WIDTH, FRAMES // COLUMNS * HEIGHT))
    for index, picture in enumerate(frames(speed, phase)):
        grid.paste(picture, (index % COLUMNS * WIDTH, index // COLUMNS * HEIGHT))
    stream = io.BytesIO()
    grid.save(stream, "WEBP", quality=70, method=0)
    return stream.getvalue()


@functools.cache
def video(speed: float) -> bytes:
    """Two seconds as MP4."""
    stream = io.BytesIO()
    with av.open(stream, "w", format="mp4") as container:
        track = container.add_stream("libx264", rate=25, options={"preset": "veryfast"})
        track.width, track.height, track.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        for picture in frames(speed, count=50):
            container.mux(track.encode(av.VideoFrame.from_image(picture)))  # type: ignore[no-untyped-call]
        container.mux(track.encode())
    return stream.getvalue()


def arrays() -> bytes:
    """Something that stands for a segment's arrays."""
    return struct.pack("<4f", 0.0, 1.0, 2.0, 3.0)
