"""What the agent does before it learns a reward."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from labels_db.run_config.base import Config


class RandomStart(Config):
    """Uniformly random actions, then learning at once."""

    kind: Literal["random"] = "random"
    seed_steps: int = Field(1000, ge=0, le=1_000_000, description="Uniformly random steps at the start.")

    @property
    def ends_at(self) -> int:
        return self.seed_steps


class StateEntropy(Config):
    """Unsupervised exploration: a reward for states far from all others (paper, section 4.1)."""

    kind: Literal["state-entropy"] = "state-entropy"
    seed_steps: int = Field(1000, ge=0, le=1_000_000, description="Uniformly random steps at the start.")
    explore_steps: int = Field(
        9000, ge=0, le=10_000_000, description="Steps of exploration that follow, before the first query."
    )
    neighbours: int = Field(
        5, ge=1, le=100, description="k: the reward is the distance to the k-th neighbour."
    )
    transform: Literal["distance", "log"] = Field(
        "distance", description="The reward is the distance itself, or its logarithm as in the paper."
    )
    states_compared: int | None = Field(
        None,
        ge=100,
        le=10_000_000,
        description="Random states of the buffer among which neighbours are sought; empty: all, as in the paper.",
    )
    reset_updates: int = Field(
        100, ge=0, le=100_000, description="Updates of the new critics right after the first fit."
    )

    @property
    def ends_at(self) -> int:
        return self.seed_steps + self.explore_steps


ExplorationConfig = Annotated[RandomStart | StateEntropy, Field(discriminator="kind")]
