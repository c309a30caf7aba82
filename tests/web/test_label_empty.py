"""An empty queue says why, fills again by itself, and calls for somebody who looks elsewhere."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Page, expect

from labels_db.models import RunState
from labels_db.records import FitReport, record_fit
from tests.labelling_rig import LabelRun
from tests.web.conftest import LiveServer
from tests.web.label_hand import Hand


@pytest.fixture
def run(live_server: LiveServer) -> LabelRun:
    return LabelRun(live_server.database, live_server.data.open_store()).begin(asked=0)


@pytest.fixture
def hand(page: Page, live_server: LiveServer, run: LabelRun) -> Hand:
    return Hand(page, live_server.url, run)


def test_the_page_says_why_and_fills_again(hand: Hand, run: LabelRun, page: Page) -> None:
    run.says(step=5000, next_session_step=7000)
    hand.look()
    sentence = page.locator("[data-sentence]")
    expect(sentence).to_have_text(re.compile(r"^The agent is training: next pairs in about \d+ s\.$"))
    before = sentence.inner_text()
    expect(sentence).not_to_have_text(before)  # it counts down
    run.says(RunState.PAUSED)
    expect(sentence).to_contain_text("Paused at step")
    run.says()
    run.post(1)
    hand.wait_for_pair().press("ArrowLeft").saved()
    assert len(run.answers()) == 1
    expect(sentence).to_be_visible()
    hand.answer("z").saved()
    assert run.standing() == {}


def test_the_title_and_the_sound_call_back(hand: Hand, run: LabelRun, page: Page) -> None:
    run.says(step=5000, next_session_step=7000)
    page.add_init_script(
        """window.beeps = 0;
        const real = AudioContext.prototype.createOscillator;
        AudioContext.prototype.createOscillator = function () { window.beeps += 1; return real.call(this); };"""
    )
    hand.look()
    page.get_by_role("button", name="Sound off").click()
    hand.until("beeps === 1")
    page.reload()
    expect(page.get_by_role("button", name="Sound on")).to_be_visible()
    expect(page.locator("[data-sentence]")).to_be_visible()
    hand.hide(hidden=True)
    run.post(3)
    hand.until("document.title.startsWith('(3) ')")
    hand.until("beeps === 1")
    assert run.leases() == []  # nobody looks, so nothing is kept from others
    hand.hide(hidden=False)
    hand.wait_for_pair()
    hand.until("!document.title.startsWith('(')")


def test_when_all_is_answered(hand: Hand, run: LabelRun, page: Page) -> None:
    run.film(5000)
    run.post(50)
    with run.database.write() as session:
        for index, (preferences, fresh) in enumerate(((10, 0.6), (40, 0.9))):
            report = FitReport(preferences, 50, 0.98, fresh)
            record_fit(
                session,
                run.owner,
                index=index,
                step=5000,
                cursor=preferences,
                report=report,
                probabilities={},
            )
    run.answer_all_as("Bob", but=1)
    hand.open()
    expect(page.locator("[data-progress]")).to_contain_text("49 of 50")
    hand.press("ArrowLeft").saved()
    expect(page.locator("[data-sentence]")).to_contain_text("All 50 answers are given. Thank you.")
    summary = page.locator("[data-summary]")
    expect(summary).to_contain_text("50 answers")
    expect(summary).to_contain_text("it guessed 60 % of new answers right; in the end 90 %")
    assert summary.locator("video").count() == 1
    run.film(15_000, 2.0)
    run.finish()
    expect(page.locator("[data-sentence]")).to_contain_text("The training is finished", timeout=8000)
    expect(summary.locator("video").last).to_have_attribute("src", "/runs/mill/videos/15000.mp4")
    expect(summary.get_by_role("link", name="See what became of it")).to_have_attribute("href", "/runs/mill")


def test_a_new_video_appears_below_the_clips(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(6)
    hand.open()
    taught = page.locator("[data-taught]")
    expect(taught).to_contain_text("Nothing yet")
    run.film(5000)
    hand.answer("ArrowLeft").saved()
    expect(taught.locator("video")).to_have_attribute("src", "/runs/mill/videos/5000.mp4")
    hand.until("document.querySelector('[data-taught] video').currentTime > 0")
    assert taught.locator("video").evaluate("video => video.muted && video.loop && !video.controls")


def test_an_archived_run_says_so(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(2)
    hand.open()
    run.archive()
    hand.press("ArrowLeft")
    expect(page.locator("[data-note]")).to_contain_text("archived")
    expect(page.locator("[data-sentence]")).to_contain_text("archived")
