"""A trained policy, taken from a run's last checkpoint: to be evaluated, exported, rolled out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from labels_db.database import Database
from labels_db.run_config import RunConfig
from labels_db.runs import Claim, config_of, get_run
from labels_db.storage import ArtifactStore
from trainer.checkpoints import CheckpointError, Checkpoints
from trainer.networks import Actor


@dataclass(frozen=True)
class TrainedPolicy:
    """The actor of a run at some step; deterministic."""

    config: RunConfig
    step: int
    actor: Actor

    @torch.no_grad()
    def __call__(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Observations [N, D] → actions [N, A]."""
        actions: NDArray[np.float32] = self.actor.best(torch.as_tensor(observations)).numpy()
        return actions

    def layers(self) -> list[tuple[NDArray[np.float32], NDArray[np.float32]]]:
        """Weight [in, out] and bias [out] of each layer, the last one for tanh(μ) only."""
        flat = self.actor.trunk.flat.detach()
        layers = [(w[0].numpy(), b[0, 0].numpy()) for w, b in self.actor.trunk.layers(flat)]
        weight, bias = layers[-1]
        size = len(bias) // 2
        return [*layers[:-1], (weight[:, :size], bias[:size])]


def load_policy(database: Database, store: ArtifactStore, run_id: str) -> TrainedPolicy:
    """The policy of the run's last checkpoint; CheckpointError when it has none yet."""
    with database.read() as session:
        config = config_of(get_run(session, run_id))
    checkpoints = Checkpoints(database, store, Claim(run_id, 0), stride=1)
    manifest = checkpoints.latest()
    if manifest is None:
        raise CheckpointError(f"run {run_id}: has no checkpoint yet; wait until its first feedback session")
    known = config.catalogue_entry
    actor = Actor(
        known.observation_size,
        known.action_size,
        config.agent.width,
        config.agent.depth,
        torch.Generator(),
    )
    actor.load_state_dict(checkpoints.state(manifest)["agent"]["actor"])
    return TrainedPolicy(config, manifest["step"], actor)
