"""The catalogue is what the simulators say."""

from __future__ import annotations

from labels_db.catalogue import catalogue
from trainer.environments.catalogue import PATH, catalogue_text


def test_the_committed_catalogue_is_up_to_date() -> None:
    how = "run `python -m trainer.environments.catalogue`"
    assert PATH.read_text(encoding="utf-8") == catalogue_text(), how


def test_every_goal_is_one_sentence_of_its_own_kind() -> None:
    for entry in catalogue().values():
        assert entry.goal.startswith("Prefer the clip in which "), entry.name
        assert entry.goal.count(".") == 1
        assert entry.goal.endswith("."), entry.name
    titles = [entry.title for entry in catalogue().values()]
    assert len(set(titles)) == len(titles)


def test_every_task_of_the_suite_is_there() -> None:
    from trainer.environments import without_gl

    with without_gl():
        from dm_control import suite
    assert {f"dmc:{domain}-{task}" for domain, task in suite.ALL_TASKS} <= catalogue().keys()
