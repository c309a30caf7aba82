"""Sprite sheets: which steps, in which grid, of what weight."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from tests.rendering import given as seen
from trainer.rendering import verify_clip
from trainer.rendering.sheet import MAX_BYTES, EncodedClip, Frame, chosen_steps, encode_clip, grid


@pytest.mark.parametrize(
    ("steps", "frames"),
    [(1, 1), (10, 10), (19, 19), (20, 20), (30, 30), (40, 20), (50, 25), (100, 25), (60, 20), (72, 24)],
)
def test_frame_counts(steps: int, frames: int) -> None:
    assert len(chosen_steps(steps)) == frames


def test_divisors_give_even_steps_and_others_the_nearest() -> None:
    assert chosen_steps(40) == list(range(0, 40, 2))
    assert chosen_steps(100) == list(range(0, 100, 4))
    assert chosen_steps(67)[:4] == [0, 3, 5, 8]  # 67 / 25 = 2.68


@given(st.integers(1, 1000))
def test_chosen_steps_span_the_segment(steps: int) -> None:
    chosen = chosen_steps(steps)
    assert chosen[0] == 0
    assert all(1 <= gap <= -(-steps // len(chosen)) for gap in np.diff(chosen))
    assert steps - steps / len(chosen) - 1 <= chosen[-1] < steps
    assert len(chosen) == steps if steps < 20 else 20 <= len(chosen) <= 30


@given(st.integers(1, 30))
def test_grids_hold_every_frame_and_are_about_square(frames: int) -> None:
    rows, columns = grid(frames)
    assert rows * columns >= frames > (rows - 1) * columns
    assert 0 <= columns - rows <= 1


def plain(count: int, width: int = 64, height: int = 48) -> list[Frame]:
    return [np.full((height, width, 3), 8 * index, np.uint8) for index in range(count)]


def encoded(frames: list[Frame]) -> EncodedClip:
    return encode_clip(frames, tuple(0.04 * index for index in range(len(frames))), 0.04 * len(frames))


def test_frames_lie_row_by_row() -> None:
    clip = encoded(plain(7))
    assert (clip.frames, clip.rows, clip.columns, clip.width, clip.height) == (7, 3, 3, 64, 48)
    for index, frame in enumerate(seen.frames(clip)):
        assert abs(float(frame.mean()) - 8 * index) < 3


def test_a_heavy_sheet_is_encoded_with_less_quality() -> None:
    noise = np.random.default_rng(0).integers(0, 255, (240, 320, 3), np.uint8)
    assert 10_000 < len(encoded([noise] * 4).data) <= MAX_BYTES


def test_a_sheet_that_no_quality_makes_light_enough_is_as_light_as_can_be() -> None:
    noise = np.random.default_rng(0).integers(0, 255, (240, 320, 3), np.uint8)
    heavy = [len(encoded([noise] * count).data) for count in (16, 25)]
    assert MAX_BYTES < heavy[0] < heavy[1]


def test_a_good_clip_passes() -> None:
    verify_clip(encoded(plain(20)))


def test_a_torn_clip_is_refused() -> None:
    clip = encoded(plain(20))
    with pytest.raises(ValueError, match="not a readable WebP"):
        verify_clip(replace(clip, data=clip.data[: len(clip.data) // 2]))


def test_another_format_is_refused() -> None:
    buffer = io.BytesIO()
    Image.new("RGB", (320, 240)).save(buffer, "PNG")
    with pytest.raises(ValueError, match="not a readable WebP"):
        verify_clip(replace(encoded(plain(1)), data=buffer.getvalue()))


def test_a_sheet_of_another_size_is_refused() -> None:
    with pytest.raises(ValueError, match=r"\(320, 192\) pixels, not \(384, 192\)"):
        verify_clip(replace(encoded(plain(20)), columns=6))
