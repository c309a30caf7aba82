"""What a hand does by accident, and what happens to the page meanwhile: nothing is answered unseen."""

from __future__ import annotations

from playwright.sync_api import Page, expect

from labels_db.models import RunState
from tests.labelling_rig import LabelRun
from tests.web.label_hand import GUARD_MS, Hand


def test_a_double_click_answers_one_pair(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(4)
    hand.open()
    box = page.get_by_role("button", name="Left", exact=True).bounding_box()
    assert box is not None
    page.wait_for_timeout(GUARD_MS)
    page.mouse.click(box["x"] + 5, box["y"] + 5)
    page.wait_for_timeout(GUARD_MS + 40)  # a slow double click, after the next pair's first frame
    page.mouse.down(click_count=2)
    page.mouse.up(click_count=2)
    hand.saved()
    assert len(run.answers()) == 1


def test_enter_held_down_on_a_button_answers_one_pair(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(4)
    hand.open()
    page.get_by_role("button", name="Left", exact=True).focus()
    page.wait_for_timeout(GUARD_MS)
    for _ in range(3):
        page.keyboard.down("Enter")
        page.wait_for_timeout(GUARD_MS + 40)
    page.keyboard.up("Enter")
    hand.saved()
    assert len(run.answers()) == 1


def test_the_key_that_opens_the_keys_closes_them(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(1)
    hand.open()
    for state in ("visible", "hidden", "visible"):
        page.keyboard.press("?")
        page.get_by_role("dialog", name="Keys").wait_for(state=state)


def test_clips_stay_large_enough_to_be_seen_on_a_low_screen(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(1)
    page.set_viewport_size({"width": 740, "height": 330})
    hand.open()
    for side in ("left", "right"):
        box = page.locator(f"[data-press={side}].clip").bounding_box()
        assert box is not None
        assert box["width"] >= 200


def test_a_run_that_ends_takes_its_pair_off_the_screen(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(1)
    hand.open()
    run.supersede()
    run.finish()
    hand.hide(hidden=True)
    hand.hide(hidden=False)
    expect(page.locator("[data-sentence]")).to_contain_text("The training is finished")


def test_pairs_that_others_answered_meanwhile_are_gone_when_one_comes_back(
    hand: Hand, run: LabelRun, page: Page
) -> None:
    run.post(3)
    run.close_session()
    hand.open()
    hand.hide(hidden=True)
    run.forget_leases()
    run.answer_all_as("Bob")
    run.says(RunState.RUNNING, next_session_step=9000)
    hand.hide(hidden=False)
    expect(page.locator("[data-sentence]")).to_contain_text("next pairs in about")
    expect(page).not_to_have_title("(3)")


def test_new_pairs_come_soon_after_the_last_was_answered(hand: Hand, run: LabelRun) -> None:
    run.post(5)
    hand.open()  # four are lent, and the page does not ask again for twenty seconds
    hand.answer("ArrowLeft", "ArrowLeft", "ArrowLeft", "ArrowLeft")
    hand.press("ArrowLeft").saved()
    run.says(RunState.RUNNING, next_session_step=9000)
    before = hand.shown
    run.post(2)
    hand.wait_for_pair(before)


def test_what_a_closed_tab_left_unsent_is_sent_by_another(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(4)
    hand.open()
    other = Hand(page.context.new_page(), hand.url, run).open()
    other.page.route("**/answers", lambda route: route.abort())
    other.answer("ArrowLeft")
    other.page.close()
    assert run.answers() == []
    hand.hide(hidden=True)
    hand.hide(hidden=False)
    hand.saved()
    assert len(run.answers()) == 1
    # Its pair is not asked again.
    hand.answer("ArrowRight").saved()
    assert len(run.standing()) == 2


def test_a_name_given_in_one_tab_counts_in_all(hand: Hand, run: LabelRun, page: Page) -> None:
    run.post(4)
    hand.open()
    other = Hand(page.context.new_page(), hand.url, run).open()
    other.page.get_by_text("Labelling as").click()
    other.page.get_by_label("Who is labelling").fill("Bea")
    other.page.keyboard.press("Enter")
    expect(page.get_by_text("Labelling as Bea")).to_be_visible()
    hand.wait_for_pair().answer("ArrowLeft").saved()
    assert [answer.labeller_id for answer in run.answers()] == [
        lease.labeller_id for lease in run.leases()[-1:]
    ]
    other.page.close()
