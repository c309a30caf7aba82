"""What differs between configurations."""

from __future__ import annotations

from labels_db.config_differences import ABSENT, config_differences
from labels_db.methods import method_named
from labels_db.overrides import with_settings
from labels_db.presets import preset_named
from tests.labels_db.given import SCRIPTED


def test_equal_configurations_differ_in_nothing() -> None:
    assert config_differences([SCRIPTED, SCRIPTED]) == []


def test_only_what_differs_is_told_in_the_order_given() -> None:
    other = with_settings(SCRIPTED, {"seed": "7", "feedback.budget": "40"})
    budget, seed = config_differences([SCRIPTED, other, SCRIPTED])
    assert (budget.path, list(budget.values)) == ("feedback.budget", [SCRIPTED.budget, 40, SCRIPTED.budget])
    assert (seed.path, list(seed.values), seed.everywhere) == ("seed", [1, 7, 1], True)
    assert budget.description.startswith("Answers in all")


def test_what_only_one_kind_has_is_absent_elsewhere_and_stays_with_its_part() -> None:
    preset = preset_named("cartpole-swingup")
    found = config_differences([method_named(name).config(preset) for name in ("sac", "pebble")])
    members = next(each for each in found if each.path == "reward.members")
    assert (list(members.values), members.everywhere) == ([ABSENT, 3], False)
    parts = [each.path.partition(".")[0] for each in found]
    assert parts == sorted(parts, key=parts.index), "settings of one part stay together"
    assert next(each for each in found if each.path == "reward.kind").everywhere
