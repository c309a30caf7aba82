"""How the robot learns from a reward."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from labels_db.run_config.base import Config

if TYPE_CHECKING:
    from labels_db.run_config.run import RunConfig


class SAC(Config):
    """Soft actor-critic (Haarnoja et al. 2018), with the paper's settings as defaults."""

    kind: Literal["sac"] = "sac"
    width: int = Field(1024, ge=8, le=4096, description="Units in each hidden layer of actor and critic.")
    depth: int = Field(2, ge=1, le=6, description="Hidden layers of actor and critic.")
    layer_norm: bool = Field(False, description="Normalise the critics' hidden layers; no in the paper.")
    batch_size: int = Field(1024, ge=8, le=8192, description="Transitions in one update.")
    learning_rate: float = Field(5e-4, gt=0, le=0.1, description="Adam's rate for actor and critic.")
    temperature_learning_rate: float = Field(1e-4, gt=0, le=0.1, description="Adam's rate for log α.")
    initial_temperature: float = Field(0.1, gt=0, le=10, description="α at the start.")
    discount: float = Field(0.99, ge=0, lt=1, description="γ, per step of the agent.")
    target_rate: float = Field(0.005, gt=0, le=1, description="τ of the target critics' Polyak average.")
    target_every: int = Field(2, ge=1, le=1000, description="Updates between two target updates.")
    updates_per_step: int = Field(1, ge=1, le=32, description="Gradient updates after each step.")
    replay_capacity: int | None = Field(
        None, ge=1000, le=10_000_000, description="Transitions kept; empty keeps every one of the run."
    )

    def transitions_kept(self, run: RunConfig) -> int:
        """Rows of the buffer, at most. N environments step together: the last time may go beyond the run's end."""
        steps_of_all = -(-run.total_steps // run.environments)
        return self.replay_capacity or steps_of_all * run.environments


class PPO(Config):
    """Proximal policy optimisation (Schulman et al. 2017), with the paper's settings for walker as defaults."""

    kind: Literal["ppo"] = "ppo"
    width: int = Field(1024, ge=8, le=4096, description="Units in each hidden layer of policy and value.")
    depth: int = Field(3, ge=1, le=6, description="Hidden layers of policy and value.")
    rollout_steps: int = Field(
        100, ge=2, le=100_000, description="Steps of each environment between two updates."
    )
    batch_size: int = Field(128, ge=8, le=65_536, description="Transitions in one gradient step.")
    epochs: int = Field(20, ge=1, le=100, description="Passes over a rollout in one update.")
    exploring_epochs: int = Field(
        50, ge=1, le=100, description="The same while there is no reward but the intrinsic one."
    )
    learning_rate: float = Field(5e-5, gt=0, le=0.1, description="Adam's rate for policy and value.")
    discount: float = Field(0.99, ge=0, lt=1, description="γ, per step of the agent.")
    gae_lambda: float = Field(0.92, ge=0, le=1, description="λ of the generalised advantage estimate.")
    clip_range: float = Field(0.2, gt=0, le=1, description="How far a policy may move in one update.")
    clip_schedule: Literal["constant", "linear"] = Field(
        "constant", description="Linear shrinks the clip range to 0 by the run's end."
    )
    entropy_bonus: float = Field(0.0, ge=0, le=1, description="Weight of the policy's entropy.")
    state_dependent_noise: bool = Field(
        True, description="Explore by a function of the state (gSDE) instead of independent noise."
    )
    noise_steps: int = Field(4, ge=1, le=1000, description="Steps after which that function is drawn anew.")
    normalise_observations: bool = Field(
        True, description="Policy and value see observations less their running mean, by their deviation."
    )

    def transitions_kept(self, run: RunConfig) -> int:
        """Rows of the buffer, at most: a rollout, or all states that exploration compares."""
        return max(self.rollout_steps * run.environments, run.exploration.ends_at)


AgentConfig = Annotated[SAC | PPO, Field(discriminator="kind")]
