"""Experiments and comparisons in a browser: curves, measures, ticks that outlast a renewal."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Browser, Page, expect
from sqlalchemy import select

from labels_db.claims import Claim, finish_run
from labels_db.models import Run
from tests.web import demo, demo_experiment
from tests.web.conftest import LiveServer
from tests.web.demo_experiment import NAME, STEPS, TASKS, TITLE

GOING = f"{NAME}-{TASKS[0]}-pebble-3"


@pytest.fixture
def opened(page: Page, live_server: LiveServer) -> Page:
    """The experiment's page, reached from the dashboard."""
    with live_server.database.write() as session:
        demo_experiment.populate(session)
    page.goto(live_server.url)
    expect(page.get_by_text("12 of 18 runs finished")).to_be_visible()
    page.get_by_role("link", name=TITLE, exact=True).click()
    return page


def test_every_task_has_its_curves(opened: Page) -> None:
    for title in ("Cart pole · swing up", "Walker · walk"):
        chart = opened.locator(".chart", has=opened.get_by_role("heading", name=title))
        expect(chart.locator("canvas")).to_be_visible()
        legend = chart.locator(".u-legend")
        for name in ("pebble, 2 seeds", "preference-ppo, 2 seeds", "sac, 2 seeds"):
            expect(legend.get_by_text(name)).to_be_visible()
        assert legend.locator("tr:visible").count() == 4  # the step and three methods; no seed by itself
    chart.hover()
    expect(legend).to_contain_text(re.compile(r"sac, 2 seeds:?\s*\d"))


def test_a_method_with_many_times_the_steps_leaves_room_for_the_others(
    opened: Page, live_server: LiveServer
) -> None:
    with live_server.database.write() as session:
        for run in session.scalars(select(Run).where(Run.method == "preference-ppo")):
            run.config = {**run.config, "total_steps": 10 * STEPS}
    opened.reload()
    chart = opened.locator(".chart").first
    expect(chart.locator(".u-legend")).to_contain_text("preference-ppo, after 50\u202f000 steps")
    box = chart.locator(".u-over").bounding_box()
    assert box is not None
    opened.mouse.move(box["x"] + box["width"] - 1, box["y"] + 50)
    expect(chart.locator(".u-legend")).to_contain_text(
        re.compile(r"Step:?\s*50\u202f000")
    )  # and not ten times as many


def test_a_measure_is_chosen_by_a_link(opened: Page) -> None:
    opened.get_by_role("link", name="Success").click()
    expect(opened.get_by_role("heading", name="Success at the last evaluation")).to_be_visible()
    expect(opened.locator(".chart h3")).to_have_text(["Cart pole · swing up"])


def test_a_page_renews_its_table_and_curves(opened: Page, live_server: LiveServer) -> None:
    expect(opened.locator(".chart")).to_have_count(2)
    with opened.expect_response(re.compile("/api/experiments/")), live_server.database.write() as session:
        run = session.get_one(Run, GOING)
        held = Claim(run.id, run.attempt)
        for step in range(STEPS // 2 + 5000, STEPS + 1, 5000):
            demo_experiment.evaluated(session, run, held, step)
        demo.going(session, held, step=STEPS)
        finish_run(session, held)
    expect(opened.get_by_text("13 of 18 runs finished, 1 under way")).to_be_visible()
    expect(opened.get_by_text("3 of 3 seeds finished")).to_be_visible()


def test_ticked_runs_stay_ticked_and_are_compared(opened: Page) -> None:
    compare = opened.get_by_role("button", name="Compare")
    expect(compare).to_be_disabled()
    ticks = opened.get_by_role("checkbox")
    ticks.nth(0).check()
    expect(opened.get_by_text("1 run chosen. Tick others, or add them next.")).to_be_visible()
    ticks.nth(3).check()
    with opened.expect_response(re.compile(f"/experiments/{NAME}")):
        pass  # the list is renewed underneath
    expect(opened.get_by_text("2 runs chosen.")).to_be_visible()
    expect(ticks.nth(0)).to_be_checked()
    compare.click()
    expect(opened.get_by_role("heading", name="2 runs compared")).to_be_visible()
    expect(opened.locator(".chart canvas")).to_be_visible()
    expect(opened.locator(".chart .u-legend tr:visible")).to_have_text(
        [re.compile("Step"), re.compile("A"), re.compile("B")]
    )
    expect(opened.get_by_role("row", name=re.compile(r"agent\.kind"))).to_contain_text("ppo")
    opened.go_back()
    expect(opened.get_by_text("2 runs chosen.")).to_be_visible()


def test_runs_from_anywhere_are_added_and_left_out_by_keys(opened: Page, live_server: LiveServer) -> None:
    with live_server.database.write() as session:
        alone = demo.queued(session, "cartpole-swingup", title="Alone").id
    opened.goto(f"{live_server.url}/runs/{alone}")
    opened.get_by_role("link", name="Compare with another run").click()
    expect(opened.get_by_role("heading", name="Compare runs")).to_be_visible()
    choice = opened.get_by_label("Another run")
    choice.focus()
    choice.select_option("Walker · walk · sac, seed 2")
    opened.keyboard.press("Tab")
    opened.keyboard.press("Enter")
    expect(opened.get_by_role("heading", name="2 runs compared")).to_be_visible()
    expect(opened.locator(".lettered h2")).to_have_text(["Alone", "Walker · walk · sac, seed 2"])
    expect(choice).to_be_in_viewport()
    opened.keyboard.press("Tab")  # where one was added, the next is chosen
    expect(choice).to_be_focused()
    choice.select_option("Cart pole · swing up · pebble, seed 1")
    opened.keyboard.press("Tab")
    opened.keyboard.press("Enter")
    expect(opened.get_by_role("heading", name="3 runs compared")).to_be_visible()
    opened.get_by_role("link", name="Success").click()
    expect(opened.locator(".lettered h2")).to_have_count(3)
    opened.get_by_role("link", name="Leave out Cart pole · swing up · pebble, seed 1").click()
    expect(opened.locator(".lettered h2")).to_have_text(["Alone", "Walker · walk · sac, seed 2"])
    expect(opened.locator(".lettered dt")).to_have_text("True return")  # neither measures success
    opened.get_by_role("link", name="Leave out Walker").click()
    opened.get_by_role("link", name="Leave out Alone").click()
    expect(opened.get_by_text("Choose at least two runs to compare.")).to_be_visible()


def test_runs_of_the_list_are_compared_without_scripts(browser: Browser, live_server: LiveServer) -> None:
    with live_server.database.write() as session:
        demo_experiment.populate(session)
        for title in ("One", "Other"):
            demo.queued(session, "cartpole-swingup", {"seed": str(len(title))}, title=title)
    with browser.new_context(java_script_enabled=False) as context:
        page = context.new_page()
        page.goto(f"{live_server.url}/?token={live_server.token}")
        page.get_by_role("button", name="Compare").click()
        expect(page.get_by_text("Choose at least two runs to compare.")).to_be_visible()
        page.goto(live_server.url)
        page.get_by_label("Compare One").check()
        page.get_by_label("Compare Other").check()
        page.get_by_role("button", name="Compare").click()
        expect(page.get_by_role("row", name="seed Where all randomness")).to_contain_text("35")
        page.get_by_label("Another run").select_option("Walker · walk · sac, seed 2")
        page.get_by_role("button", name="Add").click()
        expect(page.get_by_role("heading", name="3 runs compared")).to_be_visible()
        page.get_by_role("link", name="Leave out One").click()
        expect(page.locator(".lettered h2")).to_have_text(["Other", "Walker · walk · sac, seed 2"])
        page.goto(f"{live_server.url}/experiments/{NAME}?measure=success")
        expect(page.get_by_role("row", name="Cart pole · swing up")).to_contain_text("±")
        expect(page.get_by_role("link", name="Their numbers")).to_be_visible()
