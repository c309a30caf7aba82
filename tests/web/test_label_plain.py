"""Without scripts, by thumb, and for those who do not see the page as drawn."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.labelling_rig import LabelRun
from tests.web.label_hand import Hand

AXE = Path(__file__).parent / "vendor" / "axe" / "axe.min.js"
PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}


@pytest.mark.browser_context_args(java_script_enabled=False)
def test_without_scripts_forms_answer(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(3)
    run.lend_to("Ann", count=3, swapped=True)
    hand.look()
    strips = page.locator("figure.strip")
    assert strips.count() == 2
    assert strips.first.locator("svg").count() == 8
    assert strips.first.locator("svg").first.bounding_box() is not None
    assert page.locator("canvas").first.is_hidden()
    for name in ("Left", "Cannot tell"):
        page.get_by_role("button", name=name, exact=True).click()
    assert run.standing() == {0: "second", 1: "skip"}
    page.get_by_role("button", name="Undo my last answer").click()
    expect(page.get_by_text("Taken back.")).to_be_visible()
    page.get_by_role("button", name="Equal", exact=True).click()
    assert run.standing() == {0: "second", 1: "equal"}
    fields = ("lease_id", "answer_id", "life", "left", "right")
    form = {field: page.locator(f"[name={field}]").first.input_value() for field in fields}
    page.get_by_role("button", name="Right", exact=True).click()
    assert run.standing() == {0: "second", 1: "equal", 2: "first"}
    expect(page.locator(".plain-empty")).to_contain_text("being drawn")
    # A form sent twice changes nothing.
    form["pressed"] = "left"
    again = page.request.post(
        f"{hand.url}/runs/mill/label/answer", form=dict(form), headers={"Origin": hand.url}
    )
    assert again.ok
    assert len(run.answers()) == 5


@pytest.mark.browser_context_args(**PHONE)
def test_on_a_phone_the_better_clip_is_tapped(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(6)
    run.lend_to("Ann", count=4, swapped=False)
    hand.open()
    upper, lower = page.locator("button.clip").all()
    above, below = upper.bounding_box(), lower.bounding_box()
    assert above
    assert below
    assert above["x"] == below["x"]
    assert above["y"] + above["height"] <= below["y"]
    for name in ("Prefer the lower clip", "Equal", "Prefer the upper clip"):
        before = hand.shown
        page.wait_for_timeout(200)
        page.get_by_role("button", name=name, exact=True).tap()
        hand.wait_for_pair(before)
    hand.saved()
    assert run.standing() == {0: "second", 1: "equal", 2: "first"}
    undo = page.get_by_role("button", name="Undo")
    place = undo.bounding_box()
    assert place
    assert place["y"] + place["height"] <= 844
    assert place["x"] > 195
    undo.tap()
    hand.saved()
    assert len(run.standing()) == 2
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_nothing_serious_for_axe(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(2)
    run.film(5000)
    hand.open().answer("ArrowLeft")
    assert serious(page) == []
    page.keyboard.press("?")
    assert serious(page) == []
    page.keyboard.press("Escape")
    page.emulate_media(color_scheme="dark")
    assert serious(page) == []
    hand.press("ArrowLeft").saved()
    expect(page.locator("[data-sentence]")).to_be_visible()
    assert serious(page) == []


def serious(page: Page) -> list[str]:
    """What axe-core calls serious or critical."""
    page.evaluate(AXE.read_text(encoding="utf-8"))
    found = page.evaluate("axe.run().then((result) => result.violations)")
    return [
        f"{each['id']}: {each['nodes'][0]['html']}"
        for each in found
        if each["impact"] in ("serious", "critical")
    ]
