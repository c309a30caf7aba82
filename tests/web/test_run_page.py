"""A run's page in a browser: curves, videos, what is typed while the page renews itself."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Page, expect

from labels_db.claims import Claim, finish_run
from labels_db.goal_cards import change_goal
from labels_db.models import Run
from labels_db.policy_commands import policy_commands_of
from tests.web import demo
from tests.web.conftest import LiveServer
from tests.web.waiting import until


@pytest.fixture
def run(live_server: LiveServer, page: Page) -> Run:
    """A run with curves and two videos, its page open."""
    store = live_server.data.open_store()
    with live_server.database.write() as session:
        run = demo.queued(session, demo.WINDMILL)
        held = demo.started(session, run)
        demo.curves(session, held, 8000)
        demo.evaluated(session, store, held, range(4000, 8001, 4000))
        demo.fitted(session, held, 0, {})
        demo.posted(session, store, held, index=0, count=1)
        demo.answered(session, run.id, 1)
        demo.going(session, held, step=8000)
    page.goto(f"{live_server.url}/runs/{run.id}")
    return run


@pytest.mark.usefixtures("run")
def test_the_curves_are_drawn(page: Page) -> None:
    for title in ("True return", "Reward model: share of answers it agrees with", "Steps per second"):
        chart = page.locator(".chart", has=page.get_by_role("heading", name=title))
        expect(chart.locator("canvas")).to_be_visible()
    chart.hover()
    expect(page.locator(".chart").first.locator(".u-legend")).to_contain_text(re.compile(r"Step.*\d"))


def test_the_slider_shows_the_policy_of_another_step(page: Page, run: Run) -> None:
    video, slider = page.locator("video"), page.get_by_label("Step of the policy shown")
    expect(page.get_by_text("After step 8\u202f000")).to_be_visible()
    expect(slider).to_be_visible()
    slider.focus()
    slider.press("ArrowLeft")
    expect(page.get_by_text("After step 4\u202f000")).to_be_visible()
    expect(video).to_have_attribute("src", f"/runs/{run.id}/videos/4000.mp4")
    until(page, "document.querySelector('video').readyState >= 2")
    page.evaluate("document.querySelector('video').currentTime = 1.5")
    until(page, "document.querySelector('video').currentTime >= 1.4")


def test_the_record_renews_itself_and_leaves_what_is_typed(
    page: Page, run: Run, live_server: LiveServer
) -> None:
    page.get_by_role("button", name="Change").click()
    page.get_by_label("What labellers look for").fill("Typed by hand")
    with live_server.database.write() as session:
        change_goal(session, run.id, "From elsewhere")
    expect(page.get_by_text("The goal is now: From elsewhere")).to_be_attached()
    expect(page.get_by_label("What labellers look for")).to_have_value("Typed by hand")
    page.get_by_role("button", name="Change the goal").click()
    expect(page.locator(".goal")).to_contain_text("Typed by hand")


def test_the_link_for_labellers_is_copied(page: Page, run: Run, live_server: LiveServer) -> None:
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.get_by_role("button", name="Copy").click()
    expect(page.get_by_role("button", name="Copied")).to_be_visible()
    copied = page.evaluate("navigator.clipboard.readText()")
    assert copied == f"{live_server.url}/runs/{run.id}/label"


NO_CLIPBOARD = "Object.defineProperty(navigator, 'clipboard', { value: undefined })"
"""As on an address like http://lab-pc:8000, where browsers have none."""


def test_the_link_is_copied_where_there_is_no_clipboard(
    page: Page, run: Run, live_server: LiveServer
) -> None:
    page.add_init_script(NO_CLIPBOARD)
    page.reload()
    page.get_by_role("button", name="Copy").click()
    expect(page.get_by_role("button", name="Copied")).to_be_focused()
    page.get_by_role("button", name="Change").click()
    page.get_by_label("What labellers look for").press("ControlOrMeta+a")
    page.get_by_label("What labellers look for").press("ControlOrMeta+v")
    expect(page.get_by_label("What labellers look for")).to_have_value(
        f"{live_server.url}/runs/{run.id}/label"
    )


@pytest.mark.usefixtures("run")
def test_a_link_that_cannot_be_copied_is_selected(page: Page) -> None:
    page.add_init_script(f"{NO_CLIPBOARD}; document.execCommand = () => false")
    page.reload()
    page.get_by_role("button", name="Copy").click()
    with page.expect_response(lambda reply: "/runs/" in reply.url):
        pass  # the record is renewed underneath
    expect(page.get_by_role("button", name="Copy it by hand")).to_be_visible()
    link = page.get_by_label("Link for labellers")
    expect(link).to_be_focused()
    assert page.evaluate("getSelection().toString()") == link.input_value()
    expect(page.get_by_role("button", name="Copy", exact=True)).to_be_visible()


@pytest.mark.usefixtures("run")
def test_an_answer_shows_its_stills(page: Page) -> None:
    still = page.get_by_role("img", name="clip").first
    still.scroll_into_view_if_needed()
    expect(still).to_be_visible()
    address = still.locator("image").get_attribute("href")
    sheet = "async (address) => (await createImageBitmap(await (await fetch(address)).blob())).width"
    assert page.evaluate(sheet, address) == 5 * 320


def test_what_came_of_an_export_appears_and_is_downloaded(
    page: Page, run: Run, live_server: LiveServer
) -> None:
    with live_server.database.write() as session:
        held = Claim(run.id, run.attempt)
        demo.saved(session, held, 8000)
        finish_run(session, held)
    button = page.get_by_role("button", name="Export as ONNX")
    button.click()
    row = page.get_by_role("listitem").filter(has=button)
    expect(row).to_contain_text("Waiting for the supervisor.")
    expect(button).to_be_disabled()
    with live_server.database.write() as session:
        (command,) = policy_commands_of(session, run.id, limit=1)
        demo.exported(session, live_server.data.open_store(), command, 8000)
    with page.expect_download() as download:
        row.get_by_role("link", name="Download").click()
    assert download.value.suggested_filename == f"{run.id}-step-8000.onnx"
    expect(button).to_be_enabled()
