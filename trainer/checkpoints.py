"""Checkpoints: everything a run needs to go on exactly, as safetensors and JSON, the manifest last.

A manifest names every file it needs with its SHA-256, so a checkpoint is whole or does not exist. Rows of
the buffer and episodes of the pool are immutable files shared by all checkpoints of the run.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import Any

import structlog
from safetensors.numpy import load as load_arrays
from safetensors.numpy import save as save_arrays

from labels_db.claims import Claim
from labels_db.database import Database
from labels_db.models import Checkpoint
from labels_db.records import checkpoints_of, forget_checkpoints, record_checkpoint
from labels_db.run_config import RunConfig
from labels_db.storage import ArtifactError, ArtifactStore, sha256
from trainer.buffer_chunks import BufferChunks
from trainer.checkpoint_format import FORMAT, why_another_made_it
from trainer.episodes import EpisodePool, FinishedEpisode
from trainer.replay_buffer import ReplayBuffer
from trainer.state_tree import Arrays, pack, unpack

log = structlog.get_logger()

KEPT = 2
"""Checkpoints that stay: the last, and the one before in case the last is damaged."""


EMPTY: dict[str, Any] = {"arrays": None, "buffer": None, "episodes": []}
"""What a checkpoint that cannot be read needs."""


class CheckpointError(Exception):
    """No checkpoint of the run can be read, or only by another Pebble."""


class Checkpoints:
    """Writes and reads the checkpoints of one run."""

    def __init__(self, database: Database, store: ArtifactStore, claim: Claim, config: RunConfig) -> None:
        self.database = database
        self.store = store
        self.claim = claim
        self.config = config
        self.folder = f"runs/{claim.run_id}/checkpoints"
        self.chunks = BufferChunks(store, f"{self.folder}/chunks", stride=config.environments)
        self._episodes: dict[int, dict[str, str]] = {}

    # Writing -------------------------------------------------------------------------------------

    def save(
        self, step: int, state: dict[str, Any], buffer: ReplayBuffer | None, pool: EpisodePool | None
    ) -> None:
        """Write the state; the buffer and the pool too, unless they are dropped (a finished run)."""
        values, arrays = pack(state)
        manifest = {
            "format": FORMAT,
            "step": step,
            "values": values,
            "arrays": self._put(f"a{self.claim.attempt}-{step}", arrays),
            "buffer": None if buffer is None else self.chunks.save(buffer),
            "episodes": [] if pool is None else [self._episode(episode) for episode in pool.episodes],
        }
        data = json.dumps(manifest).encode()
        key = f"{self.folder}/a{self.claim.attempt}-{step}-{sha256(data)[:12]}.json"
        self.store.write(key, data)
        with self.database.write() as session:
            record_checkpoint(session, self.claim, step=step, manifest_key=key, checksum=sha256(data))
        self._prune(KEPT if buffer is not None else 1)

    def _put(self, name: str, arrays: Arrays) -> dict[str, str]:
        data = bytes(save_arrays(arrays))
        digest = sha256(data)
        key = f"{self.folder}/{name}-{digest[:12]}.safetensors"
        self.store.write(key, data)
        return {"key": key, "sha256": digest}

    def _episode(self, episode: FinishedEpisode) -> dict[str, str]:
        if episode.number not in self._episodes:
            arrays = {
                n: v
                for n, v in vars(episode).items()
                if n in ("observations", "actions", "rewards", "states")
            }
            numbers = {"number": episode.number, "seed": episode.seed, "policy_step": episode.policy_step}
            put = self._put(f"episode-{episode.number}", arrays)
            self._episodes[episode.number] = {**put, **numbers}  # type: ignore[dict-item]
        return self._episodes[episode.number]

    # Reading -------------------------------------------------------------------------------------

    def latest(self) -> dict[str, Any] | None:
        """The newest manifest that is whole; None when the run has none; CheckpointError when none can be read."""
        return next(self.manifests(), None)

    def manifests(self) -> Iterator[dict[str, Any]]:
        """Whole manifests, newest first. Whoever goes through all of them has found none that serves."""
        with self.database.read() as session:
            found = checkpoints_of(session, self.claim.run_id)
        for checkpoint in found:
            manifest = self._manifest(checkpoint)
            if manifest is not None:
                yield manifest
        if found:
            raise CheckpointError(
                f"run {self.claim.run_id}: none of its {len(found)} checkpoints can be read"
            )

    def _manifest(self, checkpoint: Checkpoint) -> dict[str, Any] | None:
        try:
            manifest: dict[str, Any] = json.loads(
                self.store.read(checkpoint.manifest_key, checkpoint.checksum)
            )
            self._refuse_other(manifest)
            for needed in keys_of(manifest):
                if not self.store.exists(needed):
                    raise ArtifactError(f"artifact {needed}: missing")
        except ArtifactError as error:
            log.error("a checkpoint is damaged", step=checkpoint.step, reason=str(error))
            return None
        return manifest

    def _refuse_other(self, manifest: dict[str, Any]) -> None:
        """Not passed over as if it were damaged: an older checkpoint in its place would lose what has come since."""
        if why := why_another_made_it(manifest, self.config):
            raise CheckpointError(f"run {self.claim.run_id}: {why}")

    def state(self, manifest: dict[str, Any]) -> dict[str, Any]:
        """The state that was saved with that manifest."""
        put = manifest["arrays"]
        state: dict[str, Any] = unpack(
            manifest["values"], load_arrays(self.store.read(put["key"], put["sha256"]))
        )
        return state

    def restore(self, manifest: dict[str, Any], buffer: ReplayBuffer, pool: EpisodePool | None) -> None:
        """Fill the buffer and the pool; both stay empty when a finished run dropped them."""
        if manifest["buffer"] is not None:
            self.chunks.load(buffer, manifest["buffer"])
        if pool is None:
            return
        pool.episodes.clear()
        for saved in manifest["episodes"]:
            arrays = load_arrays(self.store.read(saved["key"], saved["sha256"]))
            self._episodes[saved["number"]] = saved
            pool.add(FinishedEpisode(saved["number"], saved["seed"], saved["policy_step"], **arrays))

    # Forgetting ----------------------------------------------------------------------------------

    def _prune(self, keep: int) -> None:
        """Drop older checkpoints and the files that only they needed; rows first, then files.

        Files are listed before the record is asked whose the run is: what a later attempt writes is not among them.
        """
        present = list(self.store.keys(self.folder))
        with self.database.write() as session:
            found = checkpoints_of(session, self.claim.run_id)
            forget_checkpoints(session, self.claim, [checkpoint.id for checkpoint in found[keep:]])
        if len(found) > keep:
            self._sweep(present, found[:keep])

    def _sweep(self, present: Sequence[str], kept: Sequence[Checkpoint]) -> None:
        """Delete every file present that no kept checkpoint needs; a damaged one is passed over."""
        needed = {checkpoint.manifest_key for checkpoint in kept}
        for checkpoint in kept:
            needed |= keys_of(self._manifest(checkpoint) or EMPTY)
        for key in set(present) - needed:
            self.store.delete(key)


def keys_of(manifest: dict[str, Any]) -> set[str]:
    """Every file a manifest needs."""
    buffer = manifest["buffer"] or {"chunks": []}
    puts = [*filter(None, [manifest["arrays"]]), *buffer["chunks"], *manifest["episodes"]]
    if "rewards" in buffer:
        puts.append(buffer["rewards"])
    return {put["key"] for put in puts}
