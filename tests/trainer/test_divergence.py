"""A run that learns what is no number ends and says so; what it saved before stands."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch
from sqlalchemy import select

from labels_db.models import Checkpoint, Event, RunState
from labels_db.records import evaluations_of
from labels_db.run_config import RunConfig
from labels_db.runs import get_run
from tests.trainer.conftest import RUN, Lab, small_config
from tests.trainer.test_combinations import of_method
from trainer import evaluation
from trainer.agents.ppo_library import PPOLosses
from trainer.divergence import DivergedError, divergence, refuse_diverged_losses
from trainer.evaluation import EvaluatedEpisode
from trainer.training import Training
from trainer.upkeep import RecordedUpkeep

TRUE = {"reward__kind": "true", "feedback__kind": "none"}


def spoilt(
    lab: Lab, config: RunConfig, spoil: Callable[[Training], object], patch: pytest.MonkeyPatch
) -> list[int]:
    """Live a run that is spoilt right after a checkpoint, and fails; the steps of that checkpoint."""
    before = RecordedUpkeep.before_step
    steps: list[int] = []

    def spoiling(self: RecordedUpkeep, training: Any) -> None:
        if training.step >= 440 and not steps:
            steps.append(training.step)
            self.save(training)
            spoil(training)
        before(self, training)

    patch.setattr(RecordedUpkeep, "before_step", spoiling)
    lab.request(config)
    assert lab.live() is RunState.FAILED
    return steps


def error_of(lab: Lab) -> str:
    with lab.database.read() as session:
        return get_run(session, RUN).error or ""


def checkpoints_of(lab: Lab) -> list[int]:
    with lab.database.read() as session:
        return list(session.scalars(select(Checkpoint.step)))


def of_no_worth(training: Training) -> None:
    training.agent.buffer.reward.fill_(torch.inf)


def test_a_loss_that_is_no_number_ends_the_run(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    config = small_config(**TRUE)
    saved = spoilt(lab, config, of_no_worth, monkeypatch)
    assert "DivergedError: agent/" in error_of(lab)
    assert "is not finite any more at step 500: training diverged" in error_of(lab)
    assert checkpoints_of(lab) == saved


@pytest.mark.parametrize("number", [torch.nan, -torch.nan, torch.inf])
def test_no_checkpoint_is_made_of_what_is_no_number(
    lab: Lab, monkeypatch: pytest.MonkeyPatch, number: float
) -> None:
    """Where no loss shows it, as a negative NaN may not: its bits are below zero, and rectified to zero."""

    def spoil(training: Training) -> None:
        training.agent.state()["target_critic"]["twins.flat"].view(-1)[0] = number

    monkeypatch.setattr("trainer.upkeep.refuse_diverged_losses", lambda *_: None)
    saved = spoilt(lab, small_config(**TRUE), spoil, monkeypatch)
    assert "is not finite any more at step 900: training diverged" in error_of(lab)
    assert checkpoints_of(lab) == saved


def test_what_a_library_makes_of_it_is_not_the_reason(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    """stable-baselines3 goes on to the next minibatch, whose distribution PyTorch refuses."""
    spoilt(lab, of_method("ppo"), of_no_worth, monkeypatch)
    assert "DivergedError: agent/" in error_of(lab)


@pytest.mark.parametrize("method", ["pebble", "preference-ppo"])
def test_a_reward_model_of_no_numbers_is_the_reason(
    lab: Lab, monkeypatch: pytest.MonkeyPatch, method: str
) -> None:
    """Its answers' probabilities could not be recorded, and the agent would learn from it."""

    def spoil(training: Training) -> None:
        assert training.model is not None
        training.model.members.flat.data.fill_(torch.nan)

    spoilt(lab, of_method(method), spoil, monkeypatch)
    assert "DivergedError: reward/" in error_of(lab)


def test_returns_that_do_not_vary_have_no_explained_variance_and_end_nothing() -> None:
    logged = {"train/loss": 1.0, "train/explained_variance": float("nan")}
    assert PPOLosses(logged).read() == {"loss": 1.0}
    assert PPOLosses({**logged, "train/explained_variance": 0.5}).read()["explained_variance"] == 0.5


def test_a_loss_is_named() -> None:
    with pytest.raises(DivergedError, match="critic_loss is not finite any more at step 7"):
        refuse_diverged_losses(7, {"entropy": 0.0, "critic_loss": math.inf, "actor_loss": math.nan})


def test_the_greatest_number_is_a_number(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    refuse_diverged_losses(1, {"critic_loss": float(np.finfo(np.float32).max), "entropy": 0.0})
    found = []

    def spoil(training: Training) -> None:
        training.agent.state()["actor"]["trunk.flat"].view(-1)[0] = torch.finfo().max
        found.append(divergence(training))
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        spoilt(lab, small_config(**TRUE), spoil, monkeypatch)
    assert found == [None]


def test_returns_that_are_no_numbers_are_said_and_a_learned_reward_goes_on(
    lab: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    lived = evaluation.evaluate_episode

    def of_no_return(*arguments: Any) -> EvaluatedEpisode:
        return replace(lived(*arguments), true_return=math.nan)

    monkeypatch.setattr(evaluation, "evaluate_episode", of_no_return)
    lab.request(small_config())
    assert lab.live() is RunState.FINISHED
    with lab.database.read() as session:
        assert evaluations_of(session, RUN) == []
        said = session.scalars(select(Event.text)).all()
    assert any("The evaluation at step 900 is left out: returns [nan" in text for text in said)
