"""Real time at no more than 30 frames a second; messages that come back whole."""

from __future__ import annotations

import io
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trainer.rendering.messages import receive, send
from trainer.rendering.video import MAX_FRAMES_PER_SECOND, encoding, even, frame_rate, stride


@pytest.mark.parametrize(
    ("step_seconds", "every", "rate"),
    [(0.01, 4, 25), (0.02, 2, 25), (0.025, 2, 20), (0.04, 1, 25), (0.015, 3, Fraction(200, 9)), (0.5, 1, 2)],
)
def test_strides_and_rates(step_seconds: float, every: int, rate: Fraction) -> None:
    assert stride(step_seconds) == every
    assert frame_rate(step_seconds) == rate


@given(st.integers(1, 1000).map(lambda milliseconds: milliseconds / 1000))
def test_videos_are_real_time_and_no_faster_than_needed(step_seconds: float) -> None:
    assert frame_rate(step_seconds) <= MAX_FRAMES_PER_SECOND
    assert float(frame_rate(step_seconds)) * step_seconds * stride(step_seconds) == pytest.approx(1)


def test_a_video_of_odd_size_becomes_even(tmp_path: Path) -> None:
    pictures = [np.full((67, 65, 3), 20 * index, np.uint8) for index in range(4)]
    path = tmp_path / "video.mp4"
    for _ in encoding(iter(pictures), path, 0.05, 65, 67):
        pass
    with av.open(str(path), "r") as container:
        shown = list(container.decode(video=0))
    assert [(picture.width, picture.height) for picture in shown] == [(64, 66)] * 4


@given(st.integers(64, 1280))
def test_sizes_are_even(pixels: int) -> None:
    assert even(pixels) % 2 == 0
    assert 0 <= pixels - even(pixels) <= 1


@given(st.dictionaries(st.text(), st.integers() | st.floats(allow_nan=False)), st.binary(max_size=100))
def test_messages_come_back(header: dict[str, float], body: bytes) -> None:
    stream = io.BytesIO()
    send(stream, header, body)
    whole = stream.getvalue()
    assert receive(io.BytesIO(whole)) == (header, body)
    assert receive(io.BytesIO(whole[:-1])) is None
