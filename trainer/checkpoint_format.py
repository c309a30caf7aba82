"""What a checkpoint holds: one that holds anything else was made by another Pebble, and nothing is guessed of it."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any, TypeAlias

from labels_db.run_config import PPO, SAC, Asking, LearnedReward, RunConfig, StateEntropy
from trainer.asking_state import AskingState

FORMAT = 1
"""Raised when what a checkpoint holds means something else than it did; which parts there are is seen without it."""

Parts: TypeAlias = "Mapping[str, Parts | None]"
"""The parts of a state by name, each with its own; None where those are a library's, a device's or a simulator's."""


def _of(*names: str, **parts: Parts) -> Parts:
    return MappingProxyType({**dict.fromkeys(names), **parts})


NOTHING = _of()
MOMENTS = _of("count", "mean", "squares")
ADAM = _of("first", "second", "steps")
ROLLOUT = _of("observations", "actions", "values", "log_probs", "starts", "bootstraps")
COLLECTOR = _of("environments", "episodes", "started", "returns", "observations")
REWARD_MODEL = _of("members", optimizer=ADAM)
ASKING = _of(*(field.name for field in dataclasses.fields(AskingState)), "asks")

AGENTS: Mapping[type, Parts] = MappingProxyType(
    {
        SAC: _of(
            "actor",
            "critic",
            "target_critic",
            "log_temperature",
            "updates",
            actor_optimizer=ADAM,
            critic_optimizer=ADAM,
        ),
        PPO: _of(
            "policy",
            "optimizer",
            "noise",
            "luck",
            "steps",
            "epochs",
            "updates",
            "starts",
            "following",
            normaliser=MOMENTS,
            rollout=ROLLOUT,
        ),
    }
)


def parts_of(config: RunConfig) -> Parts:
    """All parts of the state of a run that was asked to be so."""
    counters = ("step", "fits", "relabelled", "exploring", "began_at", "evaluated", "told")
    return _of(
        *counters,
        randomness=_of("torch", "numpy"),
        collector=COLLECTOR,
        agent=AGENTS[type(config.agent)],
        reward=REWARD_MODEL if isinstance(config.reward, LearnedReward) else NOTHING,
        intrinsic=MOMENTS if isinstance(config.exploration, StateEntropy) else NOTHING,
        feedback=ASKING if isinstance(config.feedback, Asking) else NOTHING,
    )


def why_another_made_it(manifest: dict[str, Any], config: RunConfig) -> str:
    """How a checkpoint differs from ours of a run with that configuration, and the way out; empty where in nothing."""
    made = manifest["format"]
    if made != FORMAT:
        whose = "a newer Pebble; update this installation" if made > FORMAT else "an older Pebble; begin anew"
        return f"checkpoint of format {made}, where {FORMAT} is known: made by {whose}"
    differences = ", ".join(_differences(manifest["values"], parts_of(config)))
    if not differences:
        return ""
    return (
        f"its checkpoint at step {manifest['step']:,} {differences}: made by another Pebble; start a new run"
        " (the record of this one and its answers stay)"
    )


def _differences(state: Any, parts: Parts, path: str = "") -> Iterator[str]:
    """What a packed state lacks and has too much, part by part."""
    found = state if isinstance(state, dict) else {}
    yield from (f"lacks the part {path}{name}" for name in sorted(parts.keys() - found.keys()))
    yield from (f"has an unknown part {path}{name}" for name in sorted(found.keys() - parts.keys()))
    for name, within in parts.items():
        if within is not None and name in found:
            yield from _differences(found[name], within, f"{path}{name}/")
