"""Two clips, one clock; and how soon the next pair moves."""

from __future__ import annotations

import statistics

import pytest
from playwright.sync_api import Page, expect

from tests.labelling_rig import LabelRun
from tests.web.label_hand import Hand
from tests.web.pictures import FRAMES

# Every picture that the browser paints for a while: which frame each canvas says it shows, and a pixel sum.
WATCH = """milliseconds => new Promise((resolve) => {
    const seen = [], began = performance.now();
    const canvases = ["left", "right"].map((id) => document.getElementById(id));
    const copy = new OffscreenCanvas(80, 60).getContext("2d", { willReadFrequently: true });
    const sum = (canvas) => {
        copy.drawImage(canvas, 0, 0, 80, 60);
        const pixels = copy.getImageData(0, 0, 80, 60).data;
        return pixels.reduce((total, value, index) => (total + value * (index % 97)) % 1000003, 0);
    };
    const look = () => {
        seen.push(canvases.map((canvas) => [Number(canvas.dataset.frame), sum(canvas)]));
        if (performance.now() - began < milliseconds) requestAnimationFrame(look);
        else resolve(seen);
    };
    requestAnimationFrame(look);
})"""

LATENCIES = """() => {
    const marks = (name) => performance.getEntriesByName(name).map((mark) => mark.startTime);
    const shown = marks("pebble:shown");
    return marks("pebble:key").map((key) => shown.find((time) => time > key) - key);
}"""


def test_both_clips_show_the_same_frame_at_all_times(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(2)
    hand.open()
    seen = page.evaluate(WATCH, 2500)
    assert all(left[0] == right[0] for left, right in seen)
    for side in (0, 1):
        frames = {picture[side][0] for picture in seen}
        assert len(frames) > FRAMES * 0.6
        # The pictures really change, and one frame is always the same picture.
        assert len({picture[side][1] for picture in seen}) == len(frames)
    assert [left[1] for left, _ in seen] != [right[1] for _, right in seen]
    # A short hold at the end of each loop: the last frame is seen more often than any other.
    indices = [left[0] for left, _ in seen]
    assert max(set(indices), key=indices.count) == FRAMES - 1
    # Nobody looks: nothing moves.
    hand.hide(hidden=True)
    assert len({left[0] for left, _ in page.evaluate(WATCH, 300)}) == 1
    hand.hide(hidden=False)
    assert len({left[0] for left, _ in page.evaluate(WATCH, 300)}) > 2


def test_half_speed_is_remembered(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(2)
    hand.open()
    page.get_by_role("button", name="Speed 1×").click()
    page.reload()
    hand.wait_for_pair()
    expect(page.get_by_role("button", name="Speed ½×")).to_be_visible()
    hand.until("document.getElementById('left').dataset.frame === '1'")
    slow = {left[0] for left, _ in page.evaluate(WATCH, 600)}
    assert max(slow) < 0.6 * FRAMES


def test_the_next_pair_moves_within_a_tenth_of_a_second(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(24)
    hand.open()
    page.wait_for_timeout(500)
    hand.answer(*["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowLeft", "ArrowDown"] * 4)
    latencies = page.evaluate(LATENCIES)
    print(f"key to first frame, ms: median {statistics.median(latencies):.1f}, worst {max(latencies):.1f}")
    assert len(latencies) == 20
    assert statistics.median(latencies) < 100
    hand.saved()
    assert len(run.standing()) == 20


@pytest.mark.browser_context_args(reduced_motion="reduce")
def test_no_motion_for_those_who_want_none(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(3)
    run.film(5000)
    hand.open()
    hand.answer("ArrowLeft")
    assert page.evaluate("document.getAnimations().length") == 0
    video = page.locator("[data-taught] video")
    assert video.evaluate("video => video.paused && video.muted")
    page.locator("[data-taught]").get_by_role("button", name="Play").click()
    expect(page.locator("[data-taught]").get_by_role("button", name="Pause")).to_be_visible()
