"""Which products are rounded to bfloat16."""

from __future__ import annotations

import pytest
import torch

from labels_db.presets import preset_named
from labels_db.run_config import RunConfig
from trainer import precision
from trainer.agents.registry import make_agent
from trainer.agents.sac import SACAgent
from trainer.randomness import Randomness
from trainer.reward_source import ModelReward, make_reward_source

CPU = torch.device("cpu")


@pytest.mark.parametrize(
    ("wanted", "fast", "width", "depth", "expected"),
    [
        ("float32", True, 1024, 2, torch.float32),
        ("auto", True, 1024, 2, torch.bfloat16),
        ("auto", False, 1024, 2, torch.float32),
        ("auto", True, 64, 2, torch.float32),
        ("auto", True, 1024, 1, torch.float32),  # nothing but a thin product before and after it
    ],
)
def test_rounding_is_chosen_where_it_pays(
    monkeypatch: pytest.MonkeyPatch, wanted: str, fast: bool, width: int, depth: int, expected: torch.dtype
) -> None:
    monkeypatch.setattr(precision, "fast_in_bfloat16", lambda _: fast)
    config = RunConfig.model_validate({"precision": wanted})
    assert precision.product_precision(config, CPU, rows=256, width=width, depth=depth) == expected


@pytest.mark.parametrize(
    ("preset", "agent", "reward"),
    [
        ("walker-walk", torch.float32, torch.float32),
        ("walker-walk-both-legs", torch.float32, torch.float32),
        ("cartpole-swingup", torch.float32, torch.bfloat16),
        ("cartpole-windmill-clockwise", torch.float32, torch.bfloat16),
        ("drawer-close", torch.bfloat16, torch.bfloat16),
    ],
)
def test_the_laptop_profiles_round_what_the_docs_say(
    monkeypatch: pytest.MonkeyPatch, preset: str, agent: torch.dtype, reward: torch.dtype
) -> None:
    monkeypatch.setattr(precision, "fast_in_bfloat16", lambda _: True)
    config = preset_named(preset).config("laptop")
    learner, source = make_agent(config, Randomness(0), CPU), make_reward_source(config, Randomness(0), CPU)
    assert isinstance(learner, SACAgent)
    assert isinstance(source, ModelReward)
    assert (learner.precision, source.model._passes.precision) == (agent, reward)
