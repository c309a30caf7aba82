"""Where the reward comes from."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from labels_db.run_config.base import Config


class TrueReward(Config):
    """The environment's own reward: the upper bound that PEBBLE is held against."""

    kind: Literal["true"] = "true"


class LearnedReward(Config):
    """An ensemble learned from preferences (paper, section 4.2)."""

    kind: Literal["learned"] = "learned"
    members: int = Field(3, ge=1, le=16, description="Reward models in the ensemble.")
    width: int = Field(256, ge=8, le=2048, description="Units in each hidden layer of a reward model.")
    depth: int = Field(3, ge=1, le=6, description="Hidden layers of a reward model.")
    learning_rate: float = Field(3e-4, gt=0, le=0.1, description="Adam's rate for all members.")
    batch_size: int = Field(128, ge=1, le=4096, description="Preferences in one step of a fit.")
    max_epochs: int = Field(50, ge=1, le=1000, description="Passes over all preferences in one fit, at most.")
    stop_accuracy: float = Field(
        0.97, gt=0.5, le=1, description="A fit ends once an epoch's mean training accuracy exceeds this."
    )
    relabel: bool = Field(
        True, description="Give stored transitions the new reward after each fit; no is an ablation."
    )
    label_smoothing: float = Field(0.0, ge=0, lt=0.5, description="Share moved from each label to ½.")


RewardConfig = Annotated[TrueReward | LearnedReward, Field(discriminator="kind")]
