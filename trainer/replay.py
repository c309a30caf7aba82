"""Repeating a run exactly from its configuration, seed, answers and fits: one thread, on the CPU."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from labels_db.claims import Claim
from labels_db.database import Database
from labels_db.runs import config_of, get_run
from labels_db.storage import ArtifactStore, sha256
from trainer.agents.interface import Losses
from trainer.assembly import replayed_run
from trainer.checkpoints import CheckpointError, Checkpoints
from trainer.collector import Transitions
from trainer.state_tree import pack
from trainer.training import NoUpkeep, Training


@dataclass(frozen=True)
class Replayed:
    """Digests of the weights a run ended with, and of those its replay came to, at the same step."""

    run_id: str
    step: int
    recorded: str
    replayed: str

    @property
    def same(self) -> bool:
        return self.recorded == self.replayed

    def as_dict(self) -> dict[str, Any]:
        return {"run": self.run_id, "steps": self.step, "same": self.same, **vars(self)}

    def sentence(self) -> str:
        if self.same:
            return f"{self.run_id}: the same weights at step {self.step:,} ({self.replayed[:12]}…)"
        return (
            f"{self.run_id}: other weights at step {self.step:,} ({self.replayed[:12]}…, recorded"
            f" {self.recorded[:12]}…). A run repeats exactly on one thread of a CPU of the same kind."
        )


class ReachedError(Exception):
    """The training stands where the recorded one was kept."""


class UntilStep(NoUpkeep):
    """Upkeep that keeps nothing, but ends the training at a step."""

    def __init__(self, step: int, advance: Callable[[int], None]) -> None:
        self.step = step
        self.advance = advance

    def before_step(self, training: Training) -> None:
        if training.step >= self.step:
            raise ReachedError

    def after_step(self, training: Training, transitions: Transitions, losses: Losses | None) -> None:
        self.advance(len(transitions.actions))


def digest(state: dict[str, Any]) -> str:
    """SHA-256 over the weights and optimisers of agent and reward model."""
    _, arrays = pack({name: state[name] for name in ("agent", "reward")})
    return sha256(b"".join(arrays[name].tobytes() for name in sorted(arrays)))


def replay(database: Database, store: ArtifactStore, run_id: str, advance: Callable[[int], None]) -> Replayed:
    """Train the run again up to its last checkpoint; `advance` hears of every step."""
    with database.read() as session:
        config = config_of(get_run(session, run_id))
    checkpoints = Checkpoints(database, store, Claim(run_id, 0), config)
    manifest = checkpoints.latest()
    if manifest is None:
        raise CheckpointError(f"run {run_id}: has no checkpoint yet, so there is nothing to compare with")
    recorded = checkpoints.state(manifest)
    repeated = config.model_copy(update={"device": "cpu", "threads": 1})
    training = replayed_run(repeated, database, store, run_id, UntilStep(recorded["step"], advance))
    with contextlib.suppress(ReachedError):
        training.train()
    while training.fits < recorded["fits"]:  # the checkpoint was taken right after a fit at this very step
        cursor = training.feedback.before_step(training)
        if cursor is None:
            break
        training.learn_reward(cursor)
    return Replayed(run_id, recorded["step"], digest(recorded), digest(training.state()))
