"""Several tabs of one browser: what one of them keeps, another does not undo."""

from __future__ import annotations

from playwright.sync_api import Page

from tests.labelling_rig import LabelRun
from tests.web.label_hand import UNSENT, Hand

RETRY_ALL_THE_TIME = "setInterval(() => dispatchEvent(new Event('online')), 1)"


def test_a_tab_that_keeps_trying_loses_nothing_of_what_another_answers(
    hand: Hand, run: LabelRun, page: Page
) -> None:
    run.post(8)
    run.lend_to("Ann", count=8, swapped=False)
    hand.open()
    page.context.route("**/answers", lambda route: route.abort())
    hand.answer("ArrowLeft")
    page.evaluate(RETRY_ALL_THE_TIME)
    other = Hand(page.context.new_page(), hand.url, run).open()
    other.answer("ArrowLeft", "ArrowUp", "ArrowRight").press("ArrowUp")
    assert other.unsent == 5
    page.context.unroute("**/answers")
    other.saved()
    assert run.standing() == {0: "first", 1: "first", 2: "equal", 3: "second", 4: "equal"}


def test_a_pair_is_answered_here_whose_retraction_another_tab_sent(
    hand: Hand, run: LabelRun, page: Page
) -> None:
    run.post(4)
    run.lend_to("Ann", count=4, swapped=False)
    hand.open()
    other = Hand(page.context.new_page(), hand.url, run).open()
    unsent = ("**/answers", "**/retract")
    for path in unsent:
        page.context.route(path, lambda route: route.abort())
    hand.answer("ArrowLeft")
    other.hide(hidden=True)
    other.hide(hidden=False)  # and so it takes over what is unsent
    other.page.wait_for_event("requestfailed", lambda request: request.url.endswith("/answers"))
    before = hand.shown
    hand.press("z").wait_for_pair(before)
    for path in unsent:
        page.context.unroute(path)
    other.page.evaluate("dispatchEvent(new Event('online'))")
    other.until(f"{UNSENT} === 0")
    hand.press("ArrowRight").saved()
    assert run.standing() == {0: "second"}
