"""What a preset is: a named start for runs, with a profile for each purpose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from labels_db.catalogue import entry
from labels_db.overrides import Settings
from labels_db.run_config import RunConfig

Profiles = Mapping[str, RunConfig]

PROFILES: Mapping[str, str] = {
    "laptop": "Small networks and batches, bfloat16 where it pays: for a processor without a GPU.",
    "paper": "The paper's tables, to the number.",
    "public": "The authors' later public code, where it differs from the paper.",
    "few-labels": "As few answers as later papers compare with.",
}
"""Every profile, and what it is for."""


@dataclass(frozen=True)
class Preset:
    """A named start for a run; `laptop` is the first profile wherever there is one."""

    name: str
    profiles: Profiles = field(repr=False)
    on_policy: Mapping[str, Settings] = field(default_factory=dict, repr=False)
    """What PPO and its feedback set on top of a profile."""

    @property
    def title(self) -> str:
        return entry(self.environment).title

    @property
    def goal(self) -> str:
        """The goal card's first text."""
        return entry(self.environment).goal

    @property
    def environment(self) -> str:
        return self.config().environment.name

    def config(self, profile: str | None = None) -> RunConfig:
        """The profile's configuration, the first one by default; ValueError names the ones there are."""
        return self.profiles[self._known(profile)]

    def on_policy_settings(self, profile: str | None = None) -> Settings:
        """What makes the profile one of PPO; ValueError names the profiles there are."""
        chosen = self._known(profile)
        return {
            **LAPTOP_PPO,
            "total_steps": str(10 * self.config(chosen).total_steps),
            **self.on_policy.get(chosen, {}),
        }

    def _known(self, profile: str | None) -> str:
        chosen = profile or next(iter(self.profiles))
        if chosen not in self.profiles:
            raise ValueError(f"profile {chosen!r}: {self.name} has {', '.join(self.profiles)}")
        return chosen


@dataclass(frozen=True)
class FewLabels:
    """Settings of the comparison with few labels: answers in all, M, K and steps."""

    budget: int
    queries: int
    steps_between: int
    total_steps: int

    def of(self, public: RunConfig) -> RunConfig:
        """The public code's configuration with these."""
        changes = {
            "budget": self.budget,
            "queries_per_session": self.queries,
            "steps_between": self.steps_between,
        }
        feedback = public.feedback.model_copy(update=changes)
        return public.model_copy(update={"feedback": feedback, "total_steps": self.total_steps})


LAPTOP_PPO: Settings = {
    "agent.kind": "ppo",
    "agent.width": "256",
    "agent.depth": "2",
    "agent.learning_rate": "3e-4",
    "agent.rollout_steps": "100",
    "agent.batch_size": "128",
    "agent.epochs": "10",
    "agent.state_dependent_noise": "false",
    "environments": "16",
    "exploration.seed_steps": "0",
    "exploration.explore_steps": "32000",
    "evaluation.every": "50000",
    "feedback.steps_between": "16000",
}
"""On-policy learning wants ten times the steps, and many environments side by side.

Noise that depends on the state begins so wide with these networks that four of five first actions are cut off.
"""
