"""What a run is: an agent × a reward source × an exploration × a feedback, as frozen values.

Every variant is a class told apart by its `kind`; each package turns the class into a part through one
table. Field descriptions and bounds are the form of the dashboard and the reference of the docs.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from labels_db.catalogue import CatalogueEntry, entry


class Config(BaseModel):
    """A frozen value that refuses keys it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def primary(**constraints: Any) -> Any:
    """A field that a form shows first; the others wait behind "All settings"."""
    return Field(json_schema_extra={"primary": True}, **constraints)


# Environments ------------------------------------------------------------------------------------

ActionRepeat = Annotated[
    int, Field(ge=1, le=16, description="Control steps that each action is held for; 1 in the paper.")
]


class DMControl(Config):
    """A task of the dm_control suite, with its own reward."""

    kind: Literal["dmc"] = "dmc"
    task: str = Field("walker-walk", description="Domain and task of the suite, as in walker-walk.")
    action_repeat: ActionRepeat = 1

    @field_validator("task")
    @classmethod
    def _is_known(cls, task: str) -> str:
        entry(f"dmc:{task}")
        return task

    @property
    def name(self) -> str:
        return f"dmc:{self.task}"


class Behaviour(Config):
    """A wish put as a reward over the simulator, for scripted teachers to stand in for a person."""

    kind: Literal["behaviour"] = "behaviour"
    behaviour: str = Field(
        "cartpole-windmill-clockwise", description="Which behaviour, as in cartpole-windmill-clockwise."
    )
    action_repeat: ActionRepeat = 1

    @field_validator("behaviour")
    @classmethod
    def _is_known(cls, behaviour: str) -> str:
        entry(f"behaviour:{behaviour}")
        return behaviour

    @property
    def name(self) -> str:
        return f"behaviour:{self.behaviour}"


EnvironmentConfig = Annotated[DMControl | Behaviour, Field(discriminator="kind")]


# Agents ------------------------------------------------------------------------------------------


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


AgentConfig = SAC


# Where the reward comes from ---------------------------------------------------------------------


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
    label_smoothing: float = Field(0.0, ge=0, lt=0.5, description="Share moved from each label to ½.")


RewardConfig = Annotated[TrueReward | LearnedReward, Field(discriminator="kind")]


# What the agent does before it learns a reward ---------------------------------------------------


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


# Teachers ----------------------------------------------------------------------------------------


class Human(Config):
    """People, on the labelling page."""

    kind: Literal["human"] = "human"
    answers_needed: int = Field(1, ge=1, le=20, description="People who answer each query; they average.")


class Oracle(Config):
    """A scripted teacher who always prefers the larger true return; a tie is equal."""

    kind: Literal["oracle"] = "oracle"


TeacherConfig = Annotated[Human | Oracle, Field(discriminator="kind")]


# Which queries are asked -------------------------------------------------------------------------


class Uniform(Config):
    """Random pairs."""

    kind: Literal["uniform"] = "uniform"


class Disagreement(Config):
    """Pairs on whose preference the ensemble's members differ most."""

    kind: Literal["disagreement"] = "disagreement"


class Entropy(Config):
    """Pairs on which the members are least sure, on average."""

    kind: Literal["entropy"] = "entropy"


SchemeConfig = Annotated[Uniform | Disagreement | Entropy, Field(discriminator="kind")]


# When and how much is asked ----------------------------------------------------------------------


class NoFeedback(Config):
    """Nobody is asked: for runs on the true reward."""

    kind: Literal["none"] = "none"


class Asking(Config):
    """What every kind of feedback has in common."""

    teacher: TeacherConfig = primary(
        default=Oracle(), description="Who answers: people on the labelling page, or a scripted teacher."
    )
    budget: int = primary(
        default=1400,
        ge=1,
        le=1_000_000,
        description="Answers in all. People: 'cannot tell' is free. Scripted teachers: every query counts.",
    )
    scheme: SchemeConfig = Field(Entropy(), description="How queries are chosen after the first session.")
    candidates_per_query: int = Field(
        10, ge=1, le=1000, description="Random pairs scored for each one asked."
    )
    pool_episodes: int = Field(100, ge=1, le=10_000, description="Finished episodes that segments come from.")
    segment_steps: int | None = Field(
        None, ge=1, le=1000, description="H, steps of a segment; empty: as many as last one second."
    )
    fit_every: int = Field(
        10, ge=1, le=10_000, description="While streaming, new answers that set off a fit before all are in."
    )
    patience_steps: int = Field(
        10_000,
        ge=1,
        le=10_000_000,
        description="While streaming, steps without a new answer after which training waits for one.",
    )


class Sessions(Asking):
    """Feedback sessions of M queries, K steps apart (Algorithm 2)."""

    kind: Literal["sessions"] = "sessions"
    queries_per_session: int = Field(140, ge=1, le=10_000, description="M, queries in one session.")
    steps_between: int = Field(
        20_000, ge=1, le=10_000_000, description="K, steps from one session to the next."
    )
    pace: Literal["block", "stream"] = Field(
        "block",
        description="Block: training waits until a session is answered. Stream: training goes on meanwhile.",
    )


class Continuous(Asking):
    """A few fresh queries always ready; training goes on meanwhile."""

    kind: Literal["continuous"] = "continuous"
    ready: int = Field(3, ge=1, le=100, description="Open queries kept ready while budget remains.")
    fresh_steps: int = Field(
        5000, ge=1, le=10_000_000, description="Steps without an answer after which they are replaced."
    )


FeedbackConfig = Annotated[NoFeedback | Sessions | Continuous, Field(discriminator="kind")]


# The rest of a run -------------------------------------------------------------------------------


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
        description="Large products of matrices on a CPU; auto takes bfloat16 where the processor is fast at it.",
    )
    threads: int = Field(1, ge=1, le=256, description="Threads of the trainer's arithmetic on the CPU.")

    @model_validator(mode="after")
    def _parts_fit(self) -> RunConfig:
        learned, asks = self.reward.kind == "learned", self.feedback.kind != "none"
        if learned and not asks:
            raise ValueError(
                "reward.kind 'learned' needs feedback: set feedback.kind to 'sessions' or 'continuous'"
            )
        if asks and not learned:
            raise ValueError("reward.kind 'true' learns from no answers: set feedback.kind to 'none'")
        if self.exploration.ends_at >= self.total_steps:
            raise ValueError(
                f"exploration ends at step {self.exploration.ends_at}, so total_steps must be larger,"
                f" not {self.total_steps}"
            )
        self._segments_fit(self.catalogue_entry)
        return self

    def _segments_fit(self, entry: CatalogueEntry) -> None:
        episode_steps = -(-entry.episode_steps // self.environment.action_repeat)
        if not isinstance(self.feedback, NoFeedback) and self.segment_steps > episode_steps:
            raise ValueError(
                f"feedback.segment_steps {self.segment_steps} is longer than an episode of"
                f" {self.environment.name}: at most {episode_steps}"
            )

    @property
    def catalogue_entry(self) -> CatalogueEntry:
        """What is known of the environment without a simulator."""
        return entry(self.environment.name)

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
