"""Every page, light and dark, wide and narrow: accessible, within its width, quiet in the console."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Page

from tests.web import demo, demo_experiment
from tests.web.conftest import LiveServer

AXE = (Path(__file__).parent / "vendor" / "axe" / "axe.min.js").read_text(encoding="utf-8")
SERIOUS = ("serious", "critical")


def violations(page: Page, rules: str = "{}") -> list[str]:
    """What axe-core finds serious on the page, with the elements."""
    page.evaluate(AXE)
    found = page.evaluate(f"axe.run({rules})")["violations"]
    return [
        f"{page.url} {each['id']}: {[node['html'] for node in each['nodes']]}"
        for each in found
        if each["impact"] in SERIOUS
    ]


def addresses(server: LiveServer) -> list[str]:
    ids = demo.populate(server.data, server.database)
    with server.database.write() as session:
        first, second, *_ = demo_experiment.populate(session)
    pages = ["/", "/new?preset=walker-walk", "/runs/nobody", "/sign-in"]
    pages += [f"/experiments/{demo_experiment.NAME}", f"/experiments/{demo_experiment.NAME}?measure=success"]
    pages += [f"/compare?run={first}&run={second}&run={ids['teaching']}", f"/compare?run={first}", "/compare"]
    return pages + [f"/runs/{ids[state]}" for state in ("teaching", "failed", "finished")]


@pytest.mark.parametrize(
    ("scheme", "rules"),
    [("light", "{}"), ("dark", "{ runOnly: { type: 'rule', values: ['color-contrast'] } }")],
)
def test_no_page_is_hard_to_use(page: Page, live_server: LiveServer, scheme: str, rules: str) -> None:
    found = violations(page)  # a new installation's dashboard
    page.emulate_media(color_scheme=scheme)  # type: ignore[arg-type]
    for address in addresses(live_server):
        page.goto(live_server.url + address)
        page.evaluate("for (const part of document.querySelectorAll('details')) part.open = true")
        found += violations(page, rules)
    assert found == []


def test_no_page_is_wider_than_a_phone(page: Page, live_server: LiveServer) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    for address in addresses(live_server):
        page.goto(live_server.url + address)
        assert page.evaluate("document.documentElement.scrollWidth") <= 390, address
