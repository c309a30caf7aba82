"""The dashboard in a browser: starting a run through the form, watching the list, steering."""

from __future__ import annotations

from playwright.sync_api import Browser, Page, expect

from labels_db.models import Desired, Phase, RunState
from labels_db.runs import config_of, get_run
from tests.web import demo
from tests.web.conftest import LiveServer


def only_run(server: LiveServer) -> str:
    with server.database.read() as session:
        return demo.run_ids(session)[0]


def test_a_run_is_started_through_the_form(page: Page, live_server: LiveServer) -> None:
    page.get_by_role("link", name="Cart pole · clockwise windmill", exact=True).click()
    page.get_by_label("Name", exact=True).fill("My windmill")
    page.get_by_label("Teacher").select_option("oracle")
    expect(page.get_by_text("A scripted teacher who always prefers")).to_be_visible()
    page.get_by_label("Budget").fill("30")
    page.get_by_text("All settings").click()
    page.get_by_label("Queries per session").fill("5")
    page.get_by_role("button", name="Start the run").click()
    expect(page.get_by_role("heading", name="My windmill")).to_be_visible()
    expect(page.get_by_text("Next in the queue.")).to_be_visible()
    with live_server.database.read() as session:
        config = config_of(get_run(session, only_run(live_server)))
    assert (config.budget, config.asks_people) == (30, False)
    assert getattr(config.feedback, "queries_per_session", None) == 5


def test_another_kind_brings_its_fields_and_keeps_what_was_typed(page: Page, live_server: LiveServer) -> None:
    page.goto(f"{live_server.url}/new?preset=cartpole-swingup")
    page.get_by_label("Name", exact=True).fill("Kept")
    page.get_by_text("All settings").click()
    page.get_by_label("Feedback", exact=True).select_option("continuous")
    expect(page.get_by_label("Ready")).to_have_value("3")
    expect(page.get_by_label("Queries per session")).to_have_count(0)
    expect(page.get_by_label("Name", exact=True)).to_have_value("Kept")


def test_what_is_wrong_is_said_at_the_field(page: Page, live_server: LiveServer) -> None:
    page.goto(f"{live_server.url}/new?preset=cartpole-swingup")
    page.get_by_label("Budget").fill("0")
    page.get_by_role("button", name="Start the run").click()
    expect(page.get_by_text("Budget must be at least 1, not '0'.")).to_be_visible()
    expect(page.get_by_label("Budget")).to_have_attribute("aria-invalid", "true")


def test_the_list_keeps_itself_up_to_date(page: Page, live_server: LiveServer) -> None:
    with live_server.database.write() as session:
        held = demo.started(session, demo.queued(session, demo.WINDMILL))
    page.goto(live_server.url)
    expect(page.get_by_text("Starting.")).to_be_visible()
    with live_server.database.write() as session:
        demo.going(session, held, state=RunState.WAITING, phase=Phase.WAITING, wanted_answers=6)
    expect(page.get_by_text("Waiting for 6 answers.")).to_be_visible()
    expect(page.get_by_role("link", name="Label pairs of")).to_be_visible()


def test_stopping_asks_once_and_says_what_happens(page: Page, live_server: LiveServer) -> None:
    with live_server.database.write() as session:
        run = demo.queued(session, demo.WINDMILL)
        demo.going(session, demo.started(session, run))
    page.goto(live_server.url)
    page.get_by_role("button", name="Stop", exact=False).first.click()
    expect(page.get_by_text("Every answer is kept")).to_be_visible()
    page.wait_for_timeout(2500)  # the list is renewed underneath
    expect(page.get_by_text("Every answer is kept")).to_be_visible()
    page.get_by_role("button", name="Stop the run").click()
    expect(page.get_by_text("Stopping at step")).to_be_visible()
    with live_server.database.read() as session:
        assert get_run(session, run.id).desired is Desired.STOP


def test_the_theme_is_remembered(page: Page) -> None:
    def paper() -> str:
        return str(page.evaluate("getComputedStyle(document.documentElement).backgroundColor"))

    light = paper()
    page.get_by_role("button", name="Use the dark theme").click()
    dark = paper()
    assert dark != light
    page.reload()
    assert paper() == dark


def test_a_server_that_is_gone_is_said(page: Page, live_server: LiveServer) -> None:
    with live_server.database.write() as session:
        demo.queued(session, demo.WINDMILL)
    page.goto(live_server.url)
    page.context.route("**/*", lambda route: route.abort())
    expect(page.get_by_text("Pebble does not answer.")).to_be_visible()
    page.context.unroute("**/*")
    expect(page.get_by_text("Pebble does not answer.")).to_have_count(0)


def test_signing_in_with_the_form(browser: Browser, live_server: LiveServer) -> None:
    with browser.new_context() as context:
        page = context.new_page()
        page.goto(f"{live_server.url}/new?preset=walker-walk")
        page.get_by_label("Access token").fill(live_server.token)
        page.get_by_role("button", name="Sign in").click()
        expect(page.get_by_role("heading", name="New run")).to_be_visible()
        expect(page).to_have_url(f"{live_server.url}/new?preset=walker-walk")


def test_everything_works_without_scripts(browser: Browser, live_server: LiveServer) -> None:
    with browser.new_context(java_script_enabled=False) as context:
        page = context.new_page()
        page.goto(f"{live_server.url}/?token={live_server.token}")
        page.get_by_role("link", name="Cart pole · swing up").click()
        page.get_by_text("All settings").click()
        page.get_by_label("Feedback", exact=True).select_option("continuous")
        page.get_by_role("button", name="Show the settings of these kinds").click()
        page.get_by_text("All settings").click()
        page.get_by_label("Ready").fill("4")
        page.get_by_role("button", name="Start the run").click()
        expect(page.get_by_text("Next in the queue.")).to_be_visible()
        page.get_by_role("button", name="Stop", exact=False).first.click()
        page.get_by_role("button", name="Stop the run").click()
        expect(page.get_by_text("Stopped before its first step.")).to_be_visible()
