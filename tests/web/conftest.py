"""A browser signed in to the real application, which runs on a port and a data folder of its own."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import pytest
from playwright.sync_api import BrowserContext, ConsoleMessage, Page, Request

from labels_db.data_folder import DataFolder
from labels_db.database import Database
from server.token import access_token
from tests.labelling_rig import LabelRun
from tests.web.label_hand import Hand
from tests.web.serving import Serving

CHROMIUM = {
    "executable_path": "/usr/bin/chromium",
    "args": [
        "--no-sandbox",
        "--disable-gpu",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
    ],
}


@pytest.fixture(scope="session")
def browser_type_launch_args(browser_type_launch_args: dict[str, Any]) -> dict[str, Any]:
    return {**browser_type_launch_args, **CHROMIUM}


@dataclass(frozen=True)
class LiveServer:
    """A running application: its address, its data, and the record for tests to write to."""

    url: str
    data: DataFolder
    database: Database

    @property
    def token(self) -> str:
        return access_token(self.data)


@pytest.fixture
def live_server(data: DataFolder, database: Database) -> Iterator[LiveServer]:
    serving = Serving(data)
    serving.start()
    yield LiveServer(serving.url, data, database)
    serving.stop()


@dataclass
class Watched:
    """What a page must never do: complain in its console, break its policy, or ask another origin."""

    origin: str
    complaints: list[str] = field(default_factory=list)

    def console(self, message: ConsoleMessage) -> None:
        # The browser itself logs every 4xx and lost connection; tests that bring one about look at the page.
        expected = any(words in message.text for words in ("Failed to load resource", "Failed to fetch"))
        if message.type in ("error", "warning") and not expected:
            self.complaints.append(message.text)

    def request(self, request: Request) -> None:
        if not request.url.startswith((self.origin, "data:", "blob:")):
            self.complaints.append(f"request to {request.url}")


@pytest.fixture
def page(context: BrowserContext, live_server: LiveServer) -> Iterator[Page]:
    """A signed-in page on the dashboard; the test fails when any page it opens misbehaves."""
    watched = Watched(live_server.url)
    context.on("console", watched.console)
    context.on("request", watched.request)
    context.on("weberror", lambda error: watched.complaints.append(str(error.error)))
    page = context.new_page()
    page.goto(f"{live_server.url}/?token={live_server.token}")
    yield page
    page.close()
    assert watched.complaints == []


@pytest.fixture
def run(live_server: LiveServer) -> LabelRun:
    """A run that asks people, without a trainer behind it."""
    return LabelRun(live_server.database, live_server.data.open_store()).begin()


@pytest.fixture
def hand(page: Page, live_server: LiveServer, run: LabelRun) -> Hand:
    """Somebody at that run's labelling page."""
    return Hand(page, live_server.url, run)


@pytest.fixture
def page_alone(context: BrowserContext) -> Iterator[Page]:
    """A page of its own, for tests that start a whole installation; it must not misbehave either."""
    complaints: list[str] = []
    context.on("weberror", lambda error: complaints.append(str(error.error)))
    page = context.new_page()
    yield page
    page.close()
    assert complaints == []
