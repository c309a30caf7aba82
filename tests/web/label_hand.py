"""A hand on the labelling page: opens it, waits for pairs, presses keys."""

from __future__ import annotations

from dataclasses import dataclass

from playwright.sync_api import Page, expect

from tests.labelling_rig import LabelRun
from tests.web.waiting import until

UNSENT = "Object.keys(localStorage).filter((key) => key.startsWith('pebble:outbox:mill:')).length"
"""How many answers and retractions the browser keeps to be sent, on the page."""
GUARD_MS = 170
"""Longer than the page's own guard against a key that was meant for the pair before."""


@dataclass
class Hand:
    page: Page
    url: str
    run: LabelRun

    def open(self) -> Hand:
        """Go to the page as Ann and wait for the first pair."""
        return self.look().wait_for_pair()

    def look(self) -> Hand:
        """Go to the page as Ann, whatever is there."""
        self.page.context.add_cookies([{"name": "pebble_labeller", "value": "Ann", "url": self.url}])
        self.page.goto(f"{self.url}/runs/mill/label")
        return self

    def until(self, holds: str, arg: object = None, *, seconds: float = 8) -> Hand:
        """Wait until an expression or function holds on the page."""
        until(self.page, holds, arg, seconds=seconds)
        return self

    def wait_for_pair(self, after: int = 0) -> Hand:
        """Wait for one more pair to have been on screen."""
        return self.until("count => performance.getEntriesByName('pebble:shown').length > count", after)

    @property
    def shown(self) -> int:
        """How many pairs have been on screen."""
        count: int = self.page.evaluate("performance.getEntriesByName('pebble:shown').length")
        return count

    def press(self, *keys: str) -> Hand:
        """Press keys, each once the guard is over."""
        for key in keys:
            self.page.wait_for_timeout(GUARD_MS)
            self.page.keyboard.press(key)
        return self

    def answer(self, *keys: str) -> Hand:
        """Press keys, each time waiting for the next pair."""
        for key in keys:
            before = self.shown
            self.press(key)
            self.wait_for_pair(before)
        return self

    def saved(self) -> Hand:
        """Wait until the server has everything."""
        self.until(f"{UNSENT} === 0")
        expect(self.page.locator("[data-saved]")).to_have_text("Saved")
        return self

    @property
    def unsent(self) -> int:
        count: int = self.page.evaluate(UNSENT)
        return count

    def hide(self, *, hidden: bool) -> None:
        """As if somebody looked at another tab, or came back."""
        self.page.evaluate(
            """hidden => {
                Object.defineProperty(document, "hidden", { value: hidden, configurable: true });
                document.dispatchEvent(new Event("visibilitychange"));
            }""",
            hidden,
        )
