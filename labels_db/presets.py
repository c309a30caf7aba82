"""Ready configurations: a task, what people are asked to look for, and a profile for each kind of machine."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, field

from labels_db.catalogue import entry
from labels_db.run_config import (
    SAC,
    Behaviour,
    DMControl,
    Evaluation,
    Human,
    LearnedReward,
    Oracle,
    RunConfig,
    Sessions,
    StateEntropy,
)


@dataclass(frozen=True)
class Preset:
    """A named start for a run; `laptop` is the first profile wherever there is one."""

    name: str
    profiles: Mapping[str, RunConfig] = field(repr=False)

    @property
    def title(self) -> str:
        return entry(self.environment).title

    @property
    def goal(self) -> str:
        """The goal card's first text."""
        return entry(self.environment).goal

    @property
    def environment(self) -> str:
        return next(iter(self.profiles.values())).environment.name

    def config(self, profile: str | None = None) -> RunConfig:
        """The profile's configuration, the first one by default; ValueError names the ones there are."""
        chosen = profile or next(iter(self.profiles))
        if chosen not in self.profiles:
            raise ValueError(f"profile {chosen!r}: {self.name} has {', '.join(self.profiles)}")
        return self.profiles[chosen]


# Small runs with few answers differ from the paper's in three things. A learned reward is small at first: at
# the paper's temperature rate of 1e-4 the entropy bonus outweighs it for 10 000 steps. A batch of 128 would make
# fits of 50 or 200 answers one or two gradient steps an epoch. And 100 episodes are the whole run, most of them
# from policies long overcome; the latest 20 are a fifth of it, as 100 are in the paper.


def _windmill(behaviour: str) -> Preset:
    """One of the paper's human experiments: 50 queries by a person (section 5.4)."""
    laptop = RunConfig(
        environment=Behaviour(behaviour=behaviour, action_repeat=4),
        agent=SAC(width=128, batch_size=128, learning_rate=1e-3, temperature_learning_rate=1e-3),
        reward=LearnedReward(width=128, batch_size=32),
        exploration=StateEntropy(seed_steps=1000, explore_steps=2000),
        # 2500 steps take a laptop about as long as a person takes for ten answers, 25 s.
        feedback=Sessions(
            teacher=Human(),
            budget=50,
            queries_per_session=10,
            steps_between=2500,
            pace="stream",
            patience_steps=5000,
            pool_episodes=20,
        ),
        evaluation=Evaluation(every=2500, episodes=1),
        total_steps=20_000,
    )
    return Preset(behaviour, {"laptop": laptop})


def _cartpole_swingup() -> Preset:
    laptop = RunConfig(
        environment=DMControl(task="cartpole-swingup", action_repeat=4),
        agent=SAC(width=128, batch_size=128, learning_rate=1e-3, temperature_learning_rate=1e-3),
        reward=LearnedReward(width=128, batch_size=32),
        exploration=StateEntropy(seed_steps=1000, explore_steps=4000),
        feedback=Sessions(
            teacher=Oracle(), budget=200, queries_per_session=20, steps_between=2000, pool_episodes=20
        ),
        evaluation=Evaluation(every=2500, episodes=5),
        total_steps=30_000,
    )
    return Preset("cartpole-swingup", {"laptop": laptop})


def _walker_walk() -> Preset:
    """Profile `paper` is the paper's tables, to the number (algorithm: PEBBLE, oracle, 1400 answers)."""
    laptop = RunConfig(
        environment=DMControl(task="walker-walk", action_repeat=2),
        agent=SAC(width=256, batch_size=256, learning_rate=5e-4),
        feedback=Sessions(teacher=Oracle(), budget=400, queries_per_session=40, steps_between=10_000),
        evaluation=Evaluation(every=10_000, episodes=5),
        total_steps=250_000,
    )
    paper = RunConfig(
        environment=DMControl(task="walker-walk"),
        agent=SAC(width=1024, depth=2, batch_size=1024, learning_rate=5e-4),
        exploration=StateEntropy(transform="log"),
        feedback=Sessions(
            teacher=Oracle(), budget=1400, queries_per_session=140, steps_between=20_000, segment_steps=50
        ),
        evaluation=Evaluation(every=10_000, episodes=10),
        total_steps=500_000,
    )
    return Preset("walker-walk", {"laptop": laptop, "paper": paper})


def presets() -> dict[str, Preset]:
    """Every preset by name, in the order they are shown."""
    made = (
        _windmill("cartpole-windmill-clockwise"),
        _windmill("cartpole-windmill-counter-clockwise"),
        _cartpole_swingup(),
        _walker_walk(),
    )
    return {preset.name: preset for preset in made}


def preset_named(name: str) -> Preset:
    """The preset of that name; ValueError names the closest."""
    known = presets()
    if name not in known:
        close = difflib.get_close_matches(name, known, n=1) or list(known)
        raise ValueError(f"preset {name!r}: unknown; one of {', '.join(close)}")
    return known[name]
