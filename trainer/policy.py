"""A trained policy, taken from a run's last checkpoint: to be evaluated, exported, rolled out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labels_db.claims import Claim
from labels_db.database import Database
from labels_db.run_config import RunConfig
from labels_db.runs import config_of, get_run
from labels_db.storage import ArtifactStore
from trainer.agents.registry import policy_layers
from trainer.checkpoints import CheckpointError, Checkpoints
from trainer.policy_layers import PolicyLayer, roll_out


@dataclass(frozen=True)
class TrainedPolicy:
    """What a run had learned to do by some step; deterministic."""

    config: RunConfig
    step: int
    layers: Sequence[PolicyLayer]

    def __call__(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Observations [N, D] → actions [N, A]."""
        return roll_out(self.layers, observations)


def load_policy(database: Database, store: ArtifactStore, run_id: str) -> TrainedPolicy:
    """The policy of the run's last checkpoint; CheckpointError when it has none yet."""
    with database.read() as session:
        config = config_of(get_run(session, run_id))
    checkpoints = Checkpoints(database, store, Claim(run_id, 0), config)
    manifest = checkpoints.latest()
    if manifest is None:
        raise CheckpointError(f"run {run_id}: has no checkpoint yet; wait until its first feedback session")
    layers = policy_layers(config, checkpoints.state(manifest)["agent"])
    return TrainedPolicy(config, manifest["step"], layers)
