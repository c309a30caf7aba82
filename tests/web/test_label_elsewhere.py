"""One browser, several names, data folders and installations: answers are to what was on screen."""

from __future__ import annotations

import random
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, Route, expect
from sqlalchemy import select

from labels_db.data_folder import DataFolder
from labels_db.database import Database
from labels_db.models import Clip
from server.token import access_token
from tests.labelling_rig import LabelRun
from tests.web.conftest import LiveServer
from tests.web.label_hand import Hand
from tests.web.serving import Serving

ON_SCREEN = "[...document.querySelectorAll('[data-clip]')].map((canvas) => canvas.dataset.clip)"
SUM_OF = """async (url) => {
    const bytes = await (await fetch(url)).arrayBuffer();
    const sum = await crypto.subtle.digest("SHA-256", bytes);
    return [...new Uint8Array(sum)].map((byte) => byte.toString(16).padStart(2, "0")).join("");
}"""


def checksums(run: LabelRun) -> set[str]:
    with run.database.read() as session:
        return set(session.scalars(select(Clip.checksum)))


@pytest.fixture
def ours(data: DataFolder, database: Database) -> Iterator[Serving]:
    """This installation, which can be stopped for another to take its place."""
    assert database
    yield from served(Serving(data))


@pytest.fixture
def other(tmp_path: Path) -> Iterator[Serving]:
    """Another one, with a data folder of its own."""
    yield from served(Serving(DataFolder(tmp_path / "other")))


def served(serving: Serving) -> Iterator[Serving]:
    serving.start()
    yield serving
    serving.stop()


def begun(serving: Serving) -> LabelRun:
    """A run of the same name there, with other clips."""
    folder = serving.data
    return LabelRun(folder.open_database(), folder.open_store(), rng=random.Random(3)).begin()


def sign_in(page: Page, serving: Serving) -> None:
    page.goto(f"{serving.url}/?token={access_token(serving.data)}")


def take_the_place(of: Serving, other: Serving) -> None:
    of.stop()
    other.stop()
    other.port = of.port
    other.start()


def name(page: Page, wish: str) -> None:
    page.get_by_text("Labelling as").click()
    page.get_by_label("Who is labelling").fill(wish)
    page.keyboard.press("Enter")


def online(page: Page) -> None:
    page.evaluate("dispatchEvent(new Event('online'))")


def test_a_name_given_in_another_installation_takes_no_answer_away(
    run: LabelRun, live_server: LiveServer, other: Serving, page_alone: Page
) -> None:
    """Browsers tell cookies apart by machine, not by port."""
    page = page_alone
    page.goto(f"{live_server.url}/?token={live_server.token}")
    run.post(4)
    run.lend_to("Ann", count=4, swapped=False)
    hand = Hand(page, live_server.url, run).open()
    page.route("**/answers", lambda route: route.abort())
    hand.answer("ArrowLeft", "ArrowUp")
    begun(other).post(2)
    there = page.context.new_page()
    sign_in(there, other)
    there.goto(f"{other.url}/runs/mill/label")
    name(there, "Bea")
    there.get_by_text("Labelling as Bea").wait_for()
    there.close()
    page.unroute("**/answers")
    online(page)
    hand.saved()
    assert run.standing() == {0: "first", 1: "equal"}
    assert len({answer.labeller_id for answer in run.answers()}) == 1


def test_a_name_whose_reply_is_lost_takes_no_answer_away(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(4)
    page.goto(f"{hand.url}/runs/mill/label")  # under a made-up name
    hand.wait_for_pair()

    def lose_the_reply(route: Route) -> None:
        headers = {key: value for key, value in route.request.all_headers().items() if key[0] != ":"}
        wish = urllib.request.Request(
            route.request.url, route.request.post_data_buffer, headers, method="PUT"
        )
        with urllib.request.urlopen(wish) as reply:
            assert reply.status == 200
        route.abort()

    page.route("**/api/labeller", lose_the_reply)
    with page.expect_event("requestfailed"):
        name(page, "Bea")
    page.get_by_label("Who is labelling").blur()
    hand.press("ArrowLeft").saved()
    assert len(run.answers()) == 1


def test_an_answer_is_taken_back_by_who_has_another_name_by_now(
    hand: Hand, run: LabelRun, page: Page
) -> None:
    run.post(4)
    run.lend_to("Ann", count=4, swapped=False)
    hand.open().answer("ArrowLeft").saved()
    tab = Hand(page.context.new_page(), hand.url, run).open()
    name(tab.page, "Bea")
    page.get_by_text("Labelling as Bea").wait_for()
    tab.page.close()
    before = hand.wait_for_pair().shown
    hand.press("z").wait_for_pair(before).press("ArrowRight").saved()
    assert run.standing() == {0: "second"}


def test_the_clips_on_screen_are_of_the_data_folder_that_is_served(
    run: LabelRun, ours: Serving, other: Serving, page_alone: Page
) -> None:
    """Segments are numbered from 1 in every folder, and browsers keep clips for good."""
    sign_in(page_alone, ours)
    run.post(1)
    Hand(page_alone, ours.url, run).open()
    anew = begun(other)
    anew.post(1)
    take_the_place(of=ours, other=other)
    sign_in(page_alone, other)
    Hand(page_alone, other.url, anew).open()
    loaded = {url: page_alone.evaluate(SUM_OF, url) for url in page_alone.evaluate(ON_SCREEN)}
    assert checksums(run) != checksums(anew)
    assert set(loaded.values()) == checksums(anew)


def test_an_answer_waits_for_its_own_data_folder(
    run: LabelRun, ours: Serving, other: Serving, page_alone: Page
) -> None:
    sign_in(page_alone, ours)
    run.post(4)
    hand = Hand(page_alone, ours.url, run).open()
    anew = begun(other)
    anew.post(4)
    page_alone.route("**/answers", lambda route: route.abort())
    hand.answer("ArrowLeft")
    take_the_place(of=ours, other=other)
    page_alone.unroute("**/answers")
    sign_in(page_alone, other)
    there = Hand(page_alone, other.url, anew).open()
    there.press("ArrowUp")
    there.until("document.querySelector('[data-saved]').textContent === 'Saved'")
    assert list(anew.standing().values()) == ["equal"]
    assert hand.unsent == 1
    other.stop()
    ours.start()
    sign_in(page_alone, ours)
    Hand(page_alone, ours.url, run).look().saved()
    assert len(run.answers()) == 1


def test_a_page_shows_nothing_of_another_data_folder(
    run: LabelRun, ours: Serving, other: Serving, page_alone: Page
) -> None:
    """Whoever wants its pairs reloads the page: what this one keeps is of its own folder."""
    sign_in(page_alone, ours)
    run.post(4)
    hand = Hand(page_alone, ours.url, run).open()
    page_alone.route("**/answers", lambda route: route.abort())
    hand.answer("ArrowLeft")
    anew = begun(other)
    anew.post(4)
    take_the_place(of=ours, other=other)
    beside = page_alone.context.new_page()
    sign_in(beside, other)
    beside.close()
    page_alone.unroute("**/answers")
    hand.hide(hidden=True)
    hand.hide(hidden=False)
    expect(page_alone.locator("[data-sentence]")).to_contain_text("Another data folder is served here now.")
    online(page_alone)
    hand.press("ArrowUp")
    page_alone.wait_for_timeout(300)
    assert (hand.unsent, run.answers(), anew.answers()) == (1, [], [])
    page_alone.reload()
    there = Hand(page_alone, other.url, anew).wait_for_pair()
    there.press("ArrowUp")
    there.until("document.querySelector('[data-saved]').textContent === 'Saved'")
    assert list(anew.standing().values()) == ["equal"]


@pytest.mark.browser_context_args(java_script_enabled=False)
def test_a_form_counts_though_the_name_has_changed(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(2)
    run.lend_to("Ann", count=2, swapped=False)
    hand.look()
    page.context.add_cookies([{"name": "pebble_labeller", "value": "Bea", "url": hand.url}])
    page.get_by_role("button", name="Left", exact=True).click()
    assert run.standing() == {0: "first"}
    assert len({answer.labeller_id for answer in run.answers()}) == 1
