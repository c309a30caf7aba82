"""Whatever happens to page, network or server, no answer is lost and none is counted twice."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Page, Route, expect

from labels_db.data_folder import DataFolder
from labels_db.database import Database
from tests.labelling_rig import LabelRun
from tests.web.conftest import LiveServer
from tests.web.label_hand import Hand
from tests.web.serving import Serving


def test_answers_given_offline_arrive_later(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(8)
    run.lend_to("Ann", count=8, swapped=False)
    hand.open()
    page.route("**/api/**", lambda route: route.abort())
    hand.answer("ArrowLeft", "ArrowUp", "ArrowRight")
    expect(page.locator("[data-saved]")).to_have_text("3 answers not sent yet, retrying")
    expect(page.locator("[data-progress]")).to_contain_text("3 of 50")
    # The pairs lent ahead can all be answered; then the page says why it stops.
    hand.press("ArrowUp")
    expect(page.locator("[data-sentence]")).to_contain_text("Your last 4 answers are kept here.")
    assert run.answers() == []
    shown = hand.shown
    page.unroute("**/api/**")
    hand.wait_for_pair(shown).answer("ArrowLeft").saved()
    assert run.standing() == {0: "first", 1: "equal", 2: "second", 3: "equal", 4: "first"}
    assert len(run.answers()) == 5


def test_a_reply_that_is_lost_does_not_count_twice(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(4)
    hand.open()
    lost: list[str] = []

    def lose_the_first(route: Route) -> None:
        if lost:
            route.continue_()
            return
        lost.append(str(route.fetch().status))
        route.abort()

    page.route("**/answers", lose_the_first)
    hand.answer("ArrowLeft")
    hand.answer("ArrowLeft").saved()
    assert lost == ["200"]
    assert len(run.answers()) == 2


def test_a_reload_sends_what_was_left_and_keeps_the_leases(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(6)
    run.lend_to("Ann", count=4, swapped=False)
    hand.open()
    page.route("**/answers", lambda route: route.abort())
    hand.answer("ArrowLeft", "ArrowRight")
    page.unroute("**/answers")
    held = {lease.id for lease in run.leases()}
    page.reload()
    hand.wait_for_pair().saved()
    assert run.standing() == {0: "first", 1: "second"}
    hand.answer("ArrowUp", "ArrowUp").saved()
    assert run.standing() == {0: "first", 1: "second", 2: "equal", 3: "equal"}
    assert {answer.lease_id for answer in run.answers()} == held
    assert len({lease.query_id for lease in run.leases()}) == len(run.leases())


def test_leaving_gives_the_pairs_back(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(4)
    hand.open()
    hand.until("performance.getEntriesByType('resource').some((r) => r.name.endsWith('/leases'))")
    page.goto("about:blank")
    for _ in range(50):
        page.wait_for_timeout(40)
        if len(run.lend_to("Bob", count=4)) == 4:
            break
    assert len(run.lend_to("Bob", count=4)) == 4


def test_a_pair_whose_clip_is_lost_is_asked_of_nobody_again(hand: Hand, run: LabelRun) -> None:
    run.post(4)
    run.lend_to("Ann", count=4, swapped=False)
    run.lose_clip_of(1)
    hand.open().answer("ArrowLeft", "ArrowRight").press("ArrowUp").saved()
    assert run.standing() == {0: "first", 2: "second", 3: "equal"}
    assert run.states() == ["closed", "failed", "closed", "closed"]


@pytest.fixture
def restartable(data: DataFolder, database: Database) -> Iterator[Serving]:
    assert database
    serving = Serving(data)
    serving.start()
    yield serving
    serving.stop()


def test_a_server_that_restarts(
    run: LabelRun, restartable: Serving, live_server: LiveServer, page: Page
) -> None:
    run.post(8)
    run.lend_to("Ann", count=8, swapped=False)
    other = page.context.browser
    assert other is not None
    context = other.new_context()
    page = context.new_page()
    page.goto(f"{restartable.url}/?token={live_server.token}")
    hand = Hand(page, restartable.url, run).open()
    hand.answer("ArrowLeft").saved()
    restartable.stop()
    hand.answer("ArrowUp", "ArrowRight")
    expect(page.locator("[data-saved]")).to_have_text("2 answers not sent yet, retrying")
    restartable.start()
    hand.saved()
    assert run.standing() == {0: "first", 1: "equal", 2: "second"}
    assert len(run.answers()) == 3
    hand.answer("ArrowLeft").saved()
    context.close()
