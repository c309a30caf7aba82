"""Whatever happens to page, network or server, no answer is lost and none is counted twice."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Page, Route, expect

from labels_db.data_folder import DataFolder
from labels_db.database import Database
from server.token import renew_token
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


LAB_PC = "lab-pc.localhost"
"""A name other than this machine's own, which browsers look up here."""


def test_a_server_that_restarts_without_its_allowed_host(
    run: LabelRun, restartable: Serving, live_server: LiveServer, page: Page
) -> None:
    run.post(4)
    run.lend_to("Ann", count=4, swapped=False)
    restartable.stop()
    restartable.hosts = (LAB_PC,)
    restartable.start()
    assert page.context.browser is not None
    context = page.context.browser.new_context()
    page, url = context.new_page(), restartable.url.replace("127.0.0.1", LAB_PC)
    page.goto(f"{url}/?token={live_server.token}")
    hand = Hand(page, url, run).open()
    restartable.stop()
    restartable.hosts = ()
    restartable.start()
    hand.answer("ArrowLeft", "ArrowUp")
    assert page.evaluate("fetch('/').then((reply) => reply.status)") == 400
    _fail_again(page)
    expect(page.locator("[data-saved]")).to_have_text("2 answers not sent yet, retrying")
    restartable.stop()
    restartable.hosts = (LAB_PC,)
    restartable.start()
    _try_again(page)
    hand.saved()
    assert run.standing() == {0: "first", 1: "equal"}
    context.close()


NOT_PEBBLES_WORD = [
    (400, "Host 'lab-pc' is not served here."),
    (403, "<h1>Forbidden</h1>"),
    (404, "<h1>Not Found</h1>"),
    (404, '{"detail": "Not Found"}'),
    (404, "null"),
    (404, '{"detail": [{"field": "", "reason": "There is no such page."}]}'),
    (404, '{"detail": [{"field": "run_id", "reason": "run mill: not here"}]}'),
    (405, '{"detail": [{"field": "", "reason": "Method Not Allowed"}]}'),
    (409, "Conflict"),
    (413, '{"detail": [{"field": "", "reason": "A body of 70000 bytes"}]}'),
    (422, '{"message": "no"}'),
    (200, "<h1>Sign in to the network</h1>"),
    (200, "{}"),
]


def test_what_something_else_says_throws_no_answer_away(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(4)
    run.lend_to("Ann", count=4, swapped=False)
    hand.open()
    said: list[tuple[int, str]] = []

    def say_the_next(route: Route) -> None:
        said.append(NOT_PEBBLES_WORD[len(said) % len(NOT_PEBBLES_WORD)])
        route.fulfill(status=said[-1][0], body=said[-1][1])

    page.route("**/answers", say_the_next)
    hand.answer("ArrowLeft")
    while len(said) < len(NOT_PEBBLES_WORD):
        page.wait_for_timeout(50)
        assert hand.unsent == 1, said[-1]
        _try_again(page)
    expect(page.locator("[data-saved]")).to_have_text("1 answer not sent yet, retrying")
    page.unroute("**/answers")
    _try_again(page)
    hand.saved()
    assert run.standing() == {0: "first"}


def test_answers_to_a_run_that_is_not_here_are_kept(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(4)
    run.lend_to("Ann", count=4, swapped=False)
    hand.open()
    unknown = '{"detail": [{"field": "run_id", "reason": "run mill: not here"}]}'
    page.route("**/api/runs/mill/**", lambda route: route.fulfill(status=404, body=unknown))
    hand.answer("ArrowLeft").press("ArrowUp")
    _fail_again(page)
    hand.hide(hidden=True)  # and so the page asks for pairs, and hears that there is no such run
    hand.hide(hidden=False)
    expect(page.locator("[data-sentence]")).to_have_text("run mill: not here")
    expect(page.locator("[data-saved]")).to_have_text("2 answers not sent yet, retrying")
    _fail_again(page)
    expect(page.locator("[data-sentence]")).to_have_text("run mill: not here")
    page.unroute("**/api/runs/mill/**")
    _try_again(page)
    hand.saved()
    assert run.standing() == {0: "first", 1: "equal"}


def test_a_renewed_token_keeps_the_answers_until_somebody_signs_in(
    hand: Hand, run: LabelRun, live_server: LiveServer, page: Page
) -> None:
    run.post(2)
    run.lend_to("Ann", count=2, swapped=False)
    hand.open()
    token = renew_token(live_server.data)
    hand.answer("ArrowLeft").press("ArrowUp")
    expect(page.locator("[data-saved]")).to_contain_text("Signed out: open the link with the token again.")
    expect(page.locator("[data-sentence]")).to_contain_text("Signed out: open the link with the token again.")
    page.get_by_text("Labelling as").click()
    page.get_by_label("Who is labelling").fill("Bea")
    page.keyboard.press("Enter")
    expect(page.locator("[data-note]")).to_contain_text("Your last answers are still being sent")
    other = page.context.new_page()
    other.goto(f"{live_server.url}/?token={token}")
    other.close()
    _try_again(page)
    hand.saved()
    assert run.standing() == {0: "first", 1: "equal"}


def test_no_clip_is_given_up_for_what_something_else_says(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(1)
    page.route("**/artifacts/clips/**", lambda route: route.fulfill(status=400, body="no such host"))
    hand.look()
    page.wait_for_timeout(1500)
    page.unroute("**/artifacts/clips/**")
    hand.wait_for_pair().press("ArrowLeft").saved()
    assert len(run.answers()) == 1


def _try_again(page: Page) -> None:
    """At once, instead of after an ever longer while."""
    page.evaluate("dispatchEvent(new Event('online'))")


def _fail_again(page: Page) -> None:
    """Until one more try has been answered."""
    with page.expect_response("**/answers"):
        _try_again(page)
