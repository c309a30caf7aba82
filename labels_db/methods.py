"""The methods that the paper compares: each is settings on top of a preset, for the one training loop."""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from dataclasses import dataclass, field

from labels_db.overrides import Settings, with_settings
from labels_db.presets import Preset
from labels_db.run_config import RunConfig


@dataclass(frozen=True)
class Method:
    """A name, what it is in a sentence, and what it sets."""

    name: str
    sentence: str
    settings: Settings = field(default_factory=dict)
    on_policy: bool = False
    """Whether PPO learns instead of SAC, with the settings that the preset has for it."""

    def config(self, preset: Preset, profile: str | None = None) -> RunConfig:
        """The preset's configuration by this method."""
        config = preset.config(profile)
        if self.on_policy:  # first: what this method leaves out may have settings there too
            config = with_settings(config, preset.on_policy_settings(profile))
        return with_settings(config, self.settings)


TRUE_REWARD: Settings = {"reward.kind": "true", "feedback.kind": "none", "exploration.kind": "random"}
NO_PRETRAINING: Settings = {"exploration.kind": "random"}
NO_RELABELLING: Settings = {"reward.relabel": "false"}
SEGMENT_STEPS = (1, 10, 25, 50)
SCHEMES = ("uniform", "disagreement", "entropy", "k-center", "k-center-disagreement", "k-center-entropy")
SCHEDULES = ("constant", "decreasing", "increasing")
MEMBERS = (1, 3, 5)


def _compared() -> Iterator[Method]:
    yield Method("pebble", "PEBBLE: explores, asks, learns a reward, relabels everything and learns from it.")
    yield Method("sac", "SAC on the true reward: the upper bound.", TRUE_REWARD)
    yield Method("ppo", "PPO on the true reward.", TRUE_REWARD, on_policy=True)
    yield Method(
        "preference-ppo",
        "Preference PPO (Christiano et al. 2017): PPO on the learned reward, without exploration.",
        {**NO_PRETRAINING, "feedback.scheme.kind": "disagreement"},
        on_policy=True,
    )
    yield Method(
        "preference-ppo-pretrained",
        "Preference PPO after exploration by state entropy.",
        {"feedback.scheme.kind": "disagreement"},
        on_policy=True,
    )


def _ablations() -> Iterator[Method]:
    yield Method("pebble-no-relabel", "PEBBLE that keeps the rewards it once stored.", NO_RELABELLING)
    yield Method("pebble-no-pretraining", "PEBBLE that asks about random behaviour first.", NO_PRETRAINING)
    yield Method(
        "pebble-no-relabel-no-pretraining",
        "PEBBLE without relabelling and without exploration.",
        {**NO_RELABELLING, **NO_PRETRAINING},
    )
    for steps in SEGMENT_STEPS:
        sentence = f"PEBBLE with segments of {steps} step{'s' if steps > 1 else ''}."
        yield Method(f"pebble-segment-{steps}", sentence, {"feedback.segment_steps": str(steps)})
    for scheme in SCHEMES:
        yield Method(
            f"pebble-{scheme}", f"PEBBLE that selects queries by {scheme}.", {"feedback.scheme.kind": scheme}
        )
    for schedule in SCHEDULES:
        sentence = f"PEBBLE with a {schedule} number of queries in a session."
        yield Method(f"pebble-{schedule}", sentence, {"feedback.schedule": schedule})
    for members in MEMBERS:
        sentence = f"PEBBLE with {members} reward model{'s' if members > 1 else ''}."
        yield Method(f"pebble-members-{members}", sentence, {"reward.members": str(members)})


def methods() -> dict[str, Method]:
    """Every method by name, in the order they are shown."""
    return {method.name: method for method in (*_compared(), *_ablations())}


def method_named(name: str) -> Method:
    """The method of that name; ValueError names the closest."""
    known = methods()
    if name not in known:
        close = difflib.get_close_matches(name, known, n=3) or list(known)
        raise ValueError(f"method {name!r}: unknown; did you mean {', '.join(close)}?")
    return known[name]
