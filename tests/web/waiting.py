"""Waiting for a page: Playwright's own `wait_for_function` calls `eval` there, which the pages' policy forbids."""

from __future__ import annotations

from playwright.sync_api import Page


def until(page: Page, holds: str, arg: object = None, *, seconds: float = 8) -> None:
    """Wait until an expression or function holds on the page."""
    for _ in range(round(seconds / 0.05)):
        if page.evaluate(holds, arg):
            return
        page.wait_for_timeout(50)
    raise AssertionError(f"not within {seconds} s: {holds}")
