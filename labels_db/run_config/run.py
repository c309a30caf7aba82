"""One training, complete: all parts and what else it needs."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, ValidationInfo, model_validator

from labels_db.catalogue import CatalogueEntry, EnvironmentUnavailableError, entry
from labels_db.run_config.agents import PPO, SAC, AgentConfig
from labels_db.run_config.base import Config, is_recorded, primary
from labels_db.run_config.environments import DMControl, EnvironmentConfig
from labels_db.run_config.exploration import ExplorationConfig, StateEntropy
from labels_db.run_config.feedback import Asking, FeedbackConfig, NoFeedback, Sessions
from labels_db.run_config.rewards import LearnedReward, RewardConfig
from labels_db.run_config.teachers import Human

GONE = (
    "{name} is not among the environments here any more, so the run cannot go on and its policy cannot be seen."
    " `pebble environments --add {name}` brings it back where its package is installed."
)


class Evaluation(Config):
    """Episodes on an environment of their own, with the policy's mean action."""

    every: int = Field(10_000, ge=100, le=10_000_000, description="Steps between two evaluations.")
    episodes: int = Field(10, ge=1, le=1000, description="Episodes in one evaluation.")
    video: Literal["each", "last", "none"] = Field(
        "each", description="Whether an episode of each, of the last, or of no evaluation is kept as MP4."
    )


class Clips(Config):
    """How segments look to people."""

    width: int = Field(320, ge=64, le=1280, description="Pixels across a clip.")
    height: int = Field(240, ge=64, le=960, description="Pixels down a clip.")


class Checkpoints(Config):
    """What a stopped or killed run goes on from."""

    minutes: float = Field(5.0, gt=0, le=1440, description="Longest time between two checkpoints.")
    keep_buffer: bool = Field(False, description="Keep the replay buffer of a finished run.")


class RunConfig(Config):
    """One training, complete: with its seed it determines every scripted run (one thread, CPU)."""

    environment: EnvironmentConfig = Field(DMControl(), description="What the robot is and where it moves.")
    agent: AgentConfig = Field(SAC(), description="How the robot learns from a reward.")
    reward: RewardConfig = Field(LearnedReward(), description="Where the reward comes from.")
    exploration: ExplorationConfig = Field(StateEntropy(), description="What happens before any reward.")
    feedback: FeedbackConfig = Field(Sessions(), description="Who is asked, how much and when.")
    evaluation: Evaluation = Field(Evaluation(), description="How well the policy does.")
    clips: Clips = Field(Clips(), description="How segments look to people.")
    checkpoints: Checkpoints = Field(Checkpoints(), description="What a run goes on from.")
    total_steps: int = primary(
        default=500_000, ge=100, le=100_000_000, description="Steps of the agent in all."
    )
    seed: int = primary(default=1, ge=0, le=2**31 - 1, description="Where all randomness starts.")
    environments: int = Field(1, ge=1, le=256, description="Copies stepped side by side.")
    device: Literal["auto", "cpu", "cuda"] = Field(
        "auto", description="Where networks live; auto prefers a GPU."
    )
    precision: Literal["float32", "auto"] = Field(
        "float32",
        description="Large products of matrices; auto takes bfloat16 where the device is fast at it.",
    )
    threads: int | None = Field(
        None,
        ge=1,
        le=256,
        description="Threads of the trainer's arithmetic on the CPU; empty: every core for wide networks, else one.",
    )

    @model_validator(mode="after")
    def _parts_fit(self, info: ValidationInfo) -> RunConfig:
        learned, asks = self.reward.kind == "learned", self.feedback.kind != "none"
        if learned and not asks:
            raise ValueError(
                "reward.kind 'learned' needs feedback: set feedback.kind to 'sessions' or 'continuous'"
            )
        if asks and not learned:
            raise ValueError("reward.kind 'true' learns from no answers: set feedback.kind to 'none'")
        if isinstance(self.agent, PPO) and self.exploration.seed_steps:
            raise ValueError(
                "agent.kind 'ppo' learns from its own actions only: set exploration.seed_steps to 0,"
                f" not {self.exploration.seed_steps}"
            )
        if self.exploration.ends_at >= self.total_steps:
            raise ValueError(
                f"exploration ends at step {self.exploration.ends_at}, so total_steps must be larger,"
                f" not {self.total_steps}"
            )
        if not is_recorded(info):
            self._environment_fits(self.catalogue_entry)
        return self

    def _environment_fits(self, entry: CatalogueEntry) -> None:
        if self.asks_people and not entry.can_be_drawn:
            raise ValueError(
                f"feedback.teacher.kind 'human': {self.environment.name} cannot be drawn, so ask a scripted teacher"
            )
        episode_steps = -(-entry.episode_steps // self.environment.action_repeat)
        if not isinstance(self.feedback, NoFeedback) and self.segment_steps > episode_steps:
            raise ValueError(
                f"feedback.segment_steps {self.segment_steps} is longer than an episode of"
                f" {self.environment.name}: at most {episode_steps}"
            )

    @property
    def catalogue_entry(self) -> CatalogueEntry:
        """What is known of the environment without a simulator; EnvironmentUnavailableError where it is gone since."""
        try:
            return entry(self.environment.name)
        except ValueError as error:
            raise EnvironmentUnavailableError(*self.caveats) from error

    @property
    def caveats(self) -> list[str]:
        """What is questionable about learning from preferences here, or that the environment is gone."""
        if not self.environment.is_known:
            return [GONE.format(name=self.environment.name)]
        return [] if isinstance(self.feedback, NoFeedback) else self.catalogue_entry.caveats

    @property
    def step_seconds(self) -> float:
        """Simulated seconds in one step of the agent."""
        return self.catalogue_entry.control_step * self.environment.action_repeat

    @property
    def segment_steps(self) -> int:
        """H: as configured, else as many steps as last one second."""
        configured = None if isinstance(self.feedback, NoFeedback) else self.feedback.segment_steps
        return configured or max(1, round(1 / self.step_seconds))

    @property
    def budget(self) -> int:
        """Answers wanted in all; 0 where nobody is asked."""
        return 0 if isinstance(self.feedback, NoFeedback) else self.feedback.budget

    @property
    def asks_people(self) -> bool:
        return isinstance(self.feedback, Asking) and isinstance(self.feedback.teacher, Human)
