"""Settings by path: what `--set` and the form do to a configuration, and how they complain."""

from __future__ import annotations

import pytest

from labels_db.config_fields import ConfigField, fields_of
from labels_db.overrides import SettingError, variants_of, with_kinds, with_settings
from labels_db.presets import preset_named, presets
from labels_db.run_config import Continuous, Disagreement, Human, NoFeedback, RunConfig, Sessions, TrueReward
from labels_db.run_config.teachers import TeacherConfig

CONFIG = RunConfig()
PROFILES = {
    f"{name}/{profile}": config
    for name, preset in presets().items()
    for profile, config in preset.profiles.items()
}


def _typed(value: object) -> str:
    return "" if value is None else str(value)


# Good settings -----------------------------------------------------------------------------------


def test_settings_reach_any_depth() -> None:
    config = with_settings(
        CONFIG, {"seed": "7", "agent.width": "64", "feedback.teacher.kind": "human", "device": "cpu"}
    )
    assert (config.seed, config.agent.width, config.device) == (7, 64, "cpu")
    assert isinstance(config.feedback, Sessions)
    assert config.feedback.teacher == Human()


def test_no_settings_change_nothing() -> None:
    assert with_settings(CONFIG, {}) == CONFIG


def test_an_empty_value_means_none() -> None:
    shorter = with_settings(CONFIG, {"feedback.segment_steps": "10"})
    assert shorter.segment_steps == 10
    assert with_settings(shorter, {"feedback.segment_steps": ""}) == CONFIG


def test_another_kind_keeps_what_both_have() -> None:
    config = with_settings(CONFIG, {"feedback.budget": "77", "feedback.scheme.kind": "disagreement"})
    config = with_settings(config, {"feedback.kind": "continuous"})
    assert config.feedback == Continuous(budget=77, scheme=Disagreement())


@pytest.mark.parametrize("kind", [*variants_of(TeacherConfig)])
def test_another_teacher_brings_its_own_fault(kind: str) -> None:
    """An oracle's zeros are no choice that somebody made; a tie that goes to the first one is."""
    config = with_settings(CONFIG, {"feedback.teacher.kind": "oracle", "feedback.teacher.tie": "first"})
    teacher = with_settings(config, {"feedback.teacher.kind": kind}).model_dump()["feedback"]["teacher"]
    own = variants_of(TeacherConfig)[kind]().model_dump()
    assert teacher == ({**own, "tie": "first"} if "tie" in own else own)


def test_faults_compose() -> None:
    changes = {"feedback.teacher.kind": "mistake", "feedback.teacher.equal": "0.2"}
    config = with_settings(preset_named("walker-walk").config(), changes)
    teacher = with_settings(config, {"feedback.teacher.kind": "myopic"}).model_dump()["feedback"]["teacher"]
    assert (teacher["mistake"], teacher["equal"], teacher["discount"]) == (0.0, 0.2, 0.9)
    assert config.model_dump()["feedback"]["teacher"]["mistake"] == 0.1


@pytest.mark.parametrize(
    "order", [("feedback.kind", "feedback.teacher.kind"), ("feedback.teacher.kind", "feedback.kind")]
)
def test_kinds_are_chosen_from_the_outside_in(order: tuple[str, str]) -> None:
    quiet = RunConfig(reward=TrueReward(), feedback=NoFeedback())
    values = {"feedback.kind": "sessions", "feedback.teacher.kind": "human", "reward.kind": "learned"}
    settings = {path: values[path] for path in (*order, "reward.kind")}
    config = with_settings(quiet, {"feedback.teacher.answers_needed": "2", **settings})
    assert config.feedback == Sessions(teacher=Human(answers_needed=2))


def test_kinds_for_a_form_need_not_fit_yet() -> None:
    shown = with_kinds(CONFIG, {"feedback.kind": "none", "feedback.teacher.kind": "human"})
    assert shown.feedback == NoFeedback()
    assert shown.reward == CONFIG.reward


# Bad settings ------------------------------------------------------------------------------------

COMPLAINTS = [
    ({"feedback.budgt": "5"}, "feedback.budgt: unknown setting 'budgt'; did you mean budget?"),
    ({"agent.qqq": "5"}, "agent.qqq: unknown setting 'qqq'; one of kind, width, depth"),
    ({"feedbak.budget": "5"}, "feedbak.budget: unknown setting 'feedbak'; did you mean feedback?"),
    ({"seed.more": "5"}, "seed.more: 'seed' has no settings below it"),
    ({"feedback": "5"}, "feedback: has settings of its own; set one of those"),
    ({"evaluation.kind": "Evaluation"}, "evaluation.kind: is not a setting"),
    ({"feedback.kind": "sesions"}, "feedback.kind: 'sesions' is unknown; one of none, sessions, continuous"),
    ({"feedback.teacher.kind": "orakel"}, "feedback.teacher.kind: 'orakel' is unknown; one of human, oracle"),
    ({"seed": "many"}, "seed: needs a whole number, not 'many'"),
    ({"seed": "1.5"}, "seed: needs a whole number, not '1.5'"),
    ({"seed": ""}, "seed: needs a whole number, and is empty"),
    ({"agent.discount": "1.0"}, "agent.discount: must be less than 1.0, not '1.0'"),
    ({"feedback.budget": "0"}, "feedback.budget: must be at least 1, not '0'"),
    ({"device": "tpu"}, "device: must be 'auto', 'cpu' or 'cuda', not 'tpu'"),
    ({"checkpoints.keep_buffer": "perhaps"}, "checkpoints.keep_buffer: needs true or false, not 'perhaps'"),
    (
        {"environment.task": "walker-wolk"},
        "environment.task: environment 'dmc:walker-wolk': unknown; did you mean dmc:walker-walk",
    ),
    (
        {"environment.kind": "behaviour", "environment.behaviour": "windmill"},
        "environment.behaviour: environment 'behaviour:windmill': unknown; did you mean behaviour:cartpole",
    ),
    (
        {"environment.kind": "behaviour", "environment.action_repeat": "0"},
        "environment.action_repeat: must be at least 1, not '0'",
    ),
    ({"feedback.kind": "none"}, "needs feedback: set feedback.kind to 'sessions' or 'continuous'"),
    ({"": "5"}, "unknown setting ''"),
]


@pytest.mark.parametrize(("settings", "complaint"), COMPLAINTS)
def test_complaints_name_the_path_the_value_and_the_way_out(settings: dict[str, str], complaint: str) -> None:
    with pytest.raises(SettingError) as refused:
        with_settings(CONFIG, settings)
    assert complaint in str(refused.value)


# Fields ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("config", PROFILES.values(), ids=PROFILES)
def test_every_field_set_to_its_own_value_gives_the_same_configuration(config: RunConfig) -> None:
    fields = list(fields_of(config))
    assert with_settings(config, {field.path: _typed(field.value) for field in fields}) == config
    for field in fields:
        assert with_settings(config, {field.path: _typed(field.value)}) == config


@pytest.mark.parametrize("config", PROFILES.values(), ids=PROFILES)
def test_fields_describe_what_is_allowed(config: RunConfig) -> None:
    for field in fields_of(config):
        assert field.description, field.path
        if field.type in ("int", "float"):
            assert _within(field), field.path
        if field.type == "choice":
            assert str(field.value) in field.choices, field.path
            assert all(field.choices.values()), field.path


def _within(field: ConfigField) -> bool:
    assert field.minimum is not None
    assert field.maximum is not None
    return field.value is None or field.minimum <= field.value <= field.maximum


def test_fields_are_listed_part_by_part_with_kinds_first() -> None:
    fields = {field.path: field for field in fields_of(CONFIG)}
    paths = list(fields)
    assert (
        paths.index("feedback.kind") < paths.index("feedback.teacher.kind") < paths.index("feedback.budget")
    )
    assert paths.index("agent.kind") < paths.index("agent.width")
    assert (fields["agent.width"].section, fields["seed"].section) == ("agent", "")
    assert fields["feedback.segment_steps"].optional
    assert fields["feedback.budget"].primary
    assert fields["agent.discount"].open_maximum
    assert fields["agent.learning_rate"].open_minimum


def test_bounds_of_fields_are_the_bounds_that_hold() -> None:
    for field in fields_of(CONFIG):
        if field.type == "int" and field.maximum is not None:
            with pytest.raises(SettingError, match=rf"{field.path}: must be at most"):
                with_settings(CONFIG, {field.path: str(int(field.maximum) + 1)})
