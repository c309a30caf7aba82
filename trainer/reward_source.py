"""Where the rewards of new transitions come from: the environment, or a model learned from answers."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
import torch
from torch import Tensor

from labels_db.run_config import LearnedReward, RunConfig, TrueReward
from trainer.collector import Transitions
from trainer.devices import on_device
from trainer.precision import product_precision
from trainer.randomness import Randomness
from trainer.reward_model import RewardModel


class RewardSource(Protocol):
    def of(self, transitions: Transitions) -> Tensor:
        """The reward to remember with each new transition, [N]; a GPU may still be at it."""

    def state(self) -> dict[str, Any]: ...

    def load(self, state: dict[str, Any]) -> None: ...


class EnvironmentReward:
    """The task's own reward."""

    def __init__(self, device: torch.device) -> None:
        self._device = device

    def of(self, transitions: Transitions) -> Tensor:
        return on_device(transitions.true_rewards, self._device)

    def state(self) -> dict[str, Any]:
        return {}

    def load(self, state: dict[str, Any]) -> None:
        """The environment remembers nothing."""


class ModelReward:
    """The present r̂, so that a new row says what relabelling would."""

    def __init__(self, model: RewardModel) -> None:
        self.model = model

    def of(self, transitions: Transitions) -> Tensor:
        inputs = np.concatenate([transitions.observations, transitions.actions], -1)
        return self.model(on_device(inputs, self.model.device))

    def state(self) -> dict[str, Any]:
        return self.model.state()

    def load(self, state: dict[str, Any]) -> None:
        self.model.load(state)


def make_reward_source(
    config: RunConfig, randomness: Randomness, device: torch.device
) -> EnvironmentReward | ModelReward:
    source: EnvironmentReward | ModelReward = SOURCES[type(config.reward)](config, randomness, device)
    return source


def _learned(config: RunConfig, randomness: Randomness, device: torch.device) -> ModelReward:
    assert isinstance(config.reward, LearnedReward)
    known = config.catalogue_entry
    reward, rows = config.reward, config.reward.batch_size * 2 * config.segment_steps
    precision = product_precision(config, device, rows=rows, width=reward.width, depth=reward.depth)
    model = RewardModel(reward, known.observation_size, known.action_size, randomness, device, precision)
    return ModelReward(model)


SOURCES: dict[type, Any] = {
    TrueReward: lambda _config, _randomness, device: EnvironmentReward(device),
    LearnedReward: _learned,
}
