"""Several tabs of one browser: what one of them keeps, another does not undo."""

from __future__ import annotations

from playwright.sync_api import Page

from tests.labelling_rig import LabelRun
from tests.web.label_hand import Hand

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
