"""Every configuration class: frozen, closed, bounded, described; and parts that fit each other."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal, get_args, get_origin

import pytest
from pydantic import ValidationError
from pydantic.fields import FieldInfo

from labels_db.overrides import variants_of
from labels_db.run_config import (
    Behaviour,
    Config,
    Continuous,
    DMControl,
    Human,
    LearnedReward,
    NoFeedback,
    Oracle,
    RunConfig,
    Sessions,
    StateEntropy,
    TrueReward,
)


def _classes(model: type[Config] = RunConfig) -> Iterator[type[Config]]:
    """Every class that a configuration may be made of."""
    yield model
    for info in model.model_fields.values():
        for variant in variants_of(info.annotation).values():
            yield from _classes(variant)


CLASSES = sorted(set(_classes()), key=lambda model: model.__name__)
FIELDS = [
    pytest.param(model, name, info, id=f"{model.__name__}.{name}")
    for model in CLASSES
    for name, info in model.model_fields.items()
]


def _options(annotation: Any) -> tuple[Any, ...]:
    if get_origin(annotation) is Literal:
        return (annotation,)
    return get_args(annotation) or (annotation,)


@pytest.mark.parametrize("model", CLASSES)
def test_every_class_is_a_closed_value_with_words(model: type[Config]) -> None:
    value = model()
    assert (model.__doc__ or "").strip()
    with pytest.raises(ValidationError, match="frozen"):
        value.kind = "other"  # type: ignore[attr-defined]  # what is tried here is not allowed
    with pytest.raises(ValidationError, match="Extra inputs"):
        model.model_validate({"colour": "red"})
    assert model.model_validate_json(value.model_dump_json()) == value


@pytest.mark.parametrize(("model", "name", "info"), FIELDS)
def test_every_field_is_described(model: type[Config], name: str, info: FieldInfo) -> None:
    if name == "kind":
        assert get_args(info.annotation) == (info.default,)
    else:
        assert info.description, f"{model.__name__}.{name}"
        assert info.description.endswith(".")
    assert not info.is_required()


@pytest.mark.parametrize(("model", "name", "info"), FIELDS)
def test_every_number_is_bounded_on_both_sides(model: type[Config], name: str, info: FieldInfo) -> None:
    if not {int, float} & set(_options(info.annotation)):
        return
    bounds = {bound for entry in info.metadata for bound in ("ge", "gt", "le", "lt") if hasattr(entry, bound)}
    assert bounds & {"ge", "gt"}, f"{model.__name__}.{name} has no lower bound"
    assert bounds & {"le", "lt"}, f"{model.__name__}.{name} has no upper bound"


@pytest.mark.parametrize(("model", "name", "info"), FIELDS)
def test_parts_that_come_in_kinds_are_told_apart_by_them(
    model: type[Config], name: str, info: FieldInfo
) -> None:
    if len(variants_of(info.annotation)) > 1:
        assert info.discriminator == "kind", f"{model.__name__}.{name}"


def test_a_field_of_another_kind_is_refused() -> None:
    with pytest.raises(ValidationError, match=r"reward\.true\.members"):
        RunConfig.model_validate({"reward": {"kind": "true", "members": 3}, "feedback": {"kind": "none"}})


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_numbers_are_finite(value: float) -> None:
    with pytest.raises(ValidationError):
        LearnedReward(learning_rate=value)


# Parts that fit ----------------------------------------------------------------------------------

PARTS: dict[str, tuple[dict[str, Any], str]] = {
    "learned without feedback": ({"feedback": NoFeedback()}, "needs feedback: set feedback.kind"),
    "true with feedback": ({"reward": TrueReward()}, "learns from no answers: set feedback.kind to 'none'"),
    "exploration without end": (
        {"exploration": StateEntropy(seed_steps=1000, explore_steps=9000), "total_steps": 10_000},
        "exploration ends at step 10000, so total_steps must be larger, not 10000",
    ),
    "unknown task": ({"environment": {"kind": "dmc", "task": "walker-wolk"}}, "did you mean dmc:walker-walk"),
    "unknown behaviour": (
        {"environment": {"kind": "behaviour", "behaviour": "cartpole-windmill"}},
        "did you mean behaviour:cartpole-windmill",
    ),
    "segment longer than its episode": (
        {"feedback": Sessions(segment_steps=600), "environment": DMControl(action_repeat=2)},
        "feedback.segment_steps 600 is longer than an episode of dmc:walker-walk: at most 500",
    ),
}


@pytest.mark.parametrize(("parts", "message"), PARTS.values(), ids=PARTS)
def test_parts_that_do_not_fit_are_refused_with_a_way_out(parts: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError) as refused:
        RunConfig(**parts)
    assert message in str(refused.value)


def test_a_run_on_the_true_reward_asks_nobody() -> None:
    config = RunConfig(reward=TrueReward(), feedback=NoFeedback())
    assert (config.budget, config.asks_people) == (0, False)


@pytest.mark.parametrize(
    ("environment", "steps"),
    [
        (DMControl(task="walker-walk"), 40),
        (DMControl(task="walker-walk", action_repeat=2), 20),
        (Behaviour(), 100),
        (Behaviour(action_repeat=8), 12),
    ],
)
def test_a_segment_lasts_one_second_unless_told(environment: DMControl | Behaviour, steps: int) -> None:
    config = RunConfig(environment=environment)
    assert config.segment_steps == steps
    told = config.model_copy(update={"feedback": Sessions(segment_steps=7)})
    assert told.segment_steps == 7


def test_people_are_asked_by_a_human_teacher_only() -> None:
    assert RunConfig(feedback=Continuous(teacher=Human())).asks_people
    assert not RunConfig(feedback=Continuous(teacher=Oracle())).asks_people


def test_environments_that_step_together_do_not_wrap_the_buffer_before_the_end() -> None:
    """20 000 steps by threes are 20 001 transitions; a ring that wrapped could not be read into a larger one."""
    run = RunConfig.model_validate({"environments": 3, "total_steps": 20_000})
    assert run.agent.transitions_kept(run) == 20_001
