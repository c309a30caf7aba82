"""A run that learns what is no number ends and says so; what it saved before stands."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch
from sqlalchemy import select

from labels_db.models import Checkpoint, RunState
from labels_db.runs import get_run
from tests.trainer.conftest import RUN, Lab, small_config
from trainer.divergence import refuse_diverged_losses, refuse_diverged_state
from trainer.training import Training
from trainer.upkeep import RecordedUpkeep

TRUE = {"reward__kind": "true", "feedback__kind": "none"}


def spoilt(patch: pytest.MonkeyPatch, at: int, spoil: Callable[[Training], object]) -> None:
    """From now on runs are spoilt at that step."""
    before = RecordedUpkeep.before_step

    def spoiling(self: RecordedUpkeep, training: Any) -> None:
        if training.step == at:
            self.save(training)
            spoil(training)
        before(self, training)

    patch.setattr(RecordedUpkeep, "before_step", spoiling)


def error_of(lab: Lab) -> str:
    with lab.database.read() as session:
        return get_run(session, RUN).error or ""


def test_a_loss_that_is_no_number_ends_the_run(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    spoilt(monkeypatch, 450, lambda training: training.agent.buffer.reward.fill_(torch.inf))
    lab.request(small_config(**TRUE))
    assert lab.live() is RunState.FAILED
    assert "critic_loss is no finite number at step 500: training diverged" in error_of(lab)
    assert "agent.learning_rate" in error_of(lab)


@pytest.mark.parametrize("number", [torch.nan, -torch.nan, torch.inf])
def test_no_checkpoint_is_made_of_what_is_no_number(
    lab: Lab, monkeypatch: pytest.MonkeyPatch, number: float
) -> None:
    """Even where no loss shows it: the bits of a negative NaN are below zero, and rectified to zero."""

    def spoil(training: Training) -> None:
        training.agent.state()["target_critic"]["twins.flat"].view(-1)[0] = number
        monkeypatch.setattr("trainer.upkeep.refuse_diverged_losses", lambda *_: None)

    spoilt(monkeypatch, 450, spoil)
    lab.request(small_config(**TRUE))
    assert lab.live() is RunState.FAILED
    assert "is no finite number at step 900: training diverged" in error_of(lab)
    with lab.database.read() as session:
        assert session.scalars(select(Checkpoint.step)).all() == [450]


def test_the_least_number_is_a_number() -> None:
    refuse_diverged_losses(1, {"critic_loss": float(np.finfo(np.float32).max), "entropy": 0.0})
    state = {"weights": torch.full((2,), torch.finfo().min), "updates": 3, "deviation": np.zeros(2)}
    refuse_diverged_state(1, {"agent": state, "reward": {}, "collector": {"nothing": np.array(np.nan)}})
