"""Labelling by key: what is pressed is what is recorded, and undo turns it round."""

from __future__ import annotations

import re

from playwright.sync_api import Page, Response, expect

from tests.labelling_rig import LabelRun, has_true_return
from tests.web.label_hand import Hand

# Which clip a canvas shows: its pixels, compared with the same frame of each clip's sheet.
SHOWS = """async ([side, url]) => {
    const canvas = document.getElementById(side);
    const sheet = await createImageBitmap(await (await fetch(url)).blob());
    const frame = Number(canvas.dataset.frame);
    const other = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d", { willReadFrequently: true });
    other.drawImage(canvas, 0, 0);
    const seen = other.getImageData(0, 0, canvas.width, canvas.height).data;
    const [x, y] = [(frame % 5) * canvas.width, Math.floor(frame / 5) * canvas.height];
    other.drawImage(sheet, x, y, canvas.width, canvas.height, 0, 0, canvas.width, canvas.height);
    const expected = other.getImageData(0, 0, canvas.width, canvas.height).data;
    return seen.every((value, index) => value === expected[index]);
}"""


def test_a_swapped_and_an_unswapped_pair(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(3)
    run.lend_to("Ann", count=2)
    run.swap(0, swapped=False)
    run.swap(1, swapped=True)
    straight, turned = [lease.query for lease in run.leases()]
    hand.open()
    assert page.evaluate(SHOWS, ["left", f"/artifacts/clips/{straight.first_id}"])
    assert not page.evaluate(SHOWS, ["left", f"/artifacts/clips/{straight.second_id}"])
    hand.answer("ArrowLeft")
    assert page.evaluate(SHOWS, ["left", f"/artifacts/clips/{turned.second_id}"])
    assert page.evaluate(SHOWS, ["right", f"/artifacts/clips/{turned.first_id}"])
    hand.answer("ArrowLeft").saved()
    assert run.standing() == {0: "first", 1: "second"}


def test_every_key(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(8)
    run.lend_to("Ann", count=8, swapped=False)
    hand.open().answer("ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown").saved()
    assert run.standing() == {0: "first", 1: "second", 2: "equal", 3: "skip"}
    assert all(answer.shown_at and answer.goal_card_version == 1 for answer in run.answers())
    # "Cannot tell" is free.
    expect(page.locator("[data-progress]")).to_have_text(
        re.compile(r"^3 of 50 · \d+\.\d s each · about .+ left$")
    )
    hand.until("Number(document.getElementById('left').dataset.frame) > 6")
    page.keyboard.press("Space")
    hand.until("Number(document.getElementById('left').dataset.frame) < 3")
    page.keyboard.press("?")
    expect(page.get_by_role("dialog", name="Keys")).to_be_visible()
    hand.press("ArrowLeft", "Tab", "Tab")
    assert page.evaluate(
        "document.activeElement === document.body || !!document.activeElement.closest('dialog')"
    )
    page.keyboard.press("Escape")
    expect(page.get_by_role("dialog")).to_be_hidden()
    hand.answer("z").saved()
    assert run.standing() == {0: "first", 1: "second", 2: "equal"}
    assert hand.unsent == 0


def test_buttons_do_what_keys_do(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(6)
    run.lend_to("Ann", count=6, swapped=True)
    hand.open()
    for name in ("Left", "Equal", "Cannot tell", "Right"):
        before = hand.shown
        page.wait_for_timeout(200)
        page.get_by_role("button", name=name, exact=True).click()
        hand.wait_for_pair(before)
    hand.saved()
    assert run.standing() == {0: "second", 1: "equal", 2: "skip", 3: "first"}
    # A clicked button does not keep the focus, or Space would answer.
    hand.press("Space")
    page.get_by_role("button", name="Undo").click()
    hand.saved()
    assert run.standing() == {0: "second", 1: "equal", 2: "skip"}


def test_one_key_answers_one_pair(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(6)
    hand.open()
    page.wait_for_timeout(200)
    for _ in range(3):
        page.keyboard.down("ArrowLeft")  # held down: the browser repeats it
        page.wait_for_timeout(200)
    page.keyboard.up("ArrowLeft")
    hand.saved()
    assert len(run.answers()) == 1
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("ArrowLeft")  # twice within the guard
    page.get_by_text("Labelling as").click()
    page.get_by_label("Who is labelling").focus()
    hand.press("ArrowLeft", "z", "ArrowUp")
    hand.saved()
    assert len(run.answers()) == 2


def test_undo_goes_back_step_by_step(hand: Hand, run: LabelRun) -> None:
    run.post(6)
    run.lend_to("Ann", count=4, swapped=False)
    hand.open().answer("ArrowLeft", "ArrowLeft", "ArrowLeft").saved()
    hand.answer("z", "z", "z").saved()
    assert run.standing() == {}
    hand.answer("ArrowRight", "ArrowUp").saved()
    assert run.standing() == {0: "second", 1: "equal"}
    hand.press("z", "z", "z")
    hand.page.wait_for_timeout(300)
    hand.saved()
    assert run.standing() == {}
    hand.answer("ArrowLeft").saved()
    hand.page.reload()
    hand.wait_for_pair().answer("z", "ArrowRight").saved()
    assert run.standing() == {0: "second"}


def test_undo_before_the_answer_has_left(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(4)
    run.lend_to("Ann", count=4, swapped=False)
    hand.open()
    page.route("**/answers", lambda route: route.abort())
    hand.answer("ArrowLeft", "ArrowLeft")
    assert hand.unsent == 2
    # The second was never tried and simply goes; the first may have arrived and is retracted.
    hand.answer("z", "z", "ArrowRight", "ArrowUp")
    page.unroute("**/answers")
    hand.saved()
    assert run.standing() == {0: "second", 1: "equal"}
    assert [answer.pressed for answer in run.answers()] == ["left", None, "right", "equal"]


def test_a_pair_answered_elsewhere_is_passed_over(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(5)
    hand.open()
    other = Hand(page.context.new_page(), hand.url, run).open()
    other.answer("ArrowUp").saved()
    hand.answer("ArrowLeft")
    expect(page.locator("[data-note]")).to_contain_text("passed over")
    hand.answer("ArrowUp").saved()
    assert len(run.standing()) == 2
    assert run.standing()[0] == "equal"
    other.page.close()


def test_nothing_on_the_page_tells_what_a_segment_is_worth(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(5)
    run.film(5000)
    texts: list[str] = []

    def keep(response: Response) -> None:
        if "/artifacts/" not in response.url and "/videos/" not in response.url and response.ok:
            texts.append(response.text())

    page.on("response", keep)
    hand.open().answer("ArrowLeft", "z", "ArrowRight").saved()
    page.remove_listener("response", keep)
    assert len(texts) > 10
    assert not [text for text in [*texts, page.content()] if has_true_return(text)]


def test_a_name_makes_two_browsers_two_labellers(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(2)
    hand.open()
    page.get_by_text("Labelling as Ann").click()
    page.get_by_label("Who is labelling").fill("Ada")
    with page.expect_navigation():
        page.get_by_role("button", name="Use this name").click()
    hand.wait_for_pair().answer("ArrowLeft").saved()
    expect(page.get_by_text("Labelling as Ada")).to_be_visible()
    assert len({lease.labeller_id for lease in run.leases()}) == 2
