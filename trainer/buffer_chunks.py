"""The replay buffer's rows as immutable chunks named by their SHA-256 and shared by all checkpoints.

What a checkpoint costs follows the new rows, not the buffer: full chunks are written once. Rewards are a
column of their own, since every relabelling changes them. A next observation is stored only where it is
not the observation of the row that follows in the same environment.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import torch
from safetensors.numpy import load as load_arrays
from safetensors.numpy import save as save_arrays

from labels_db.storage import ArtifactStore, sha256
from trainer.replay_buffer import ReplayBuffer

CHUNK_ROWS = 10_000


@dataclass(frozen=True)
class Chunk:
    """Rows [start, stop) counted since the run's first transition."""

    start: int
    stop: int
    key: str
    sha256: str


class BufferChunks:
    """Writes a buffer to the store and reads it back; remembers what is already there."""

    def __init__(self, store: ArtifactStore, folder: str, stride: int) -> None:
        self.store = store
        self.folder = folder
        self.stride = stride  # rows between two transitions of one environment
        self._written: dict[int, Chunk] = {}

    def save(self, buffer: ReplayBuffer) -> dict[str, Any]:
        """Write the rows that no earlier checkpoint holds; returns the manifest's part."""
        chunks = [self._chunk(buffer, start) for start in _starts(buffer)]
        self._written = {c.start: c for c in chunks if c.stop - c.start == CHUNK_ROWS}
        rewards = buffer.reward[: len(buffer)].cpu().numpy()
        return {
            "added": buffer.added,
            "chunks": [asdict(chunk) for chunk in chunks],
            "rewards": self._put({"reward": rewards}),
        }

    def load(self, buffer: ReplayBuffer, manifest: dict[str, Any]) -> None:
        """Fill the buffer with the rows of a checkpoint, each in its own place of the ring."""
        chunks = [Chunk(**chunk) for chunk in manifest["chunks"]]
        for chunk in chunks:
            self._restore(buffer, chunk, manifest["added"])
        rewards = load_arrays(self.store.read(**_address(manifest["rewards"])))["reward"]
        buffer.reward[: len(rewards)] = torch.from_numpy(rewards).to(buffer.device)
        buffer.added = manifest["added"]
        self._written = {c.start: c for c in chunks if c.stop - c.start == CHUNK_ROWS}

    def _chunk(self, buffer: ReplayBuffer, start: int) -> Chunk:
        known = self._written.get(start)
        if known is not None:
            return known
        oldest = buffer.added - len(buffer)
        first, stop = max(start, oldest), min(start + CHUNK_ROWS, buffer.added)
        put = self._put(_columns(buffer, first, stop, self.stride))
        return Chunk(first, stop, **put)

    def _put(self, arrays: dict[str, np.ndarray[Any, Any]]) -> dict[str, str]:
        # A column of a table is not contiguous, and safetensors would take the bytes that follow its first.
        data = bytes(save_arrays({name: np.ascontiguousarray(array) for name, array in arrays.items()}))
        digest = sha256(data)
        key = f"{self.folder}/{digest}.safetensors"
        self.store.write(key, data)  # also where a file of that name is: it may be a damaged one
        return {"key": key, "sha256": digest}

    def _restore(self, buffer: ReplayBuffer, chunk: Chunk, added: int) -> None:
        arrays = load_arrays(self.store.read(chunk.key, chunk.sha256))
        followers = np.arange(chunk.stop - chunk.start) + self.stride
        followers[arrays["own_rows"]] = 0
        next_observation = arrays["observation"][np.minimum(followers, len(followers) - 1)].copy()
        next_observation[arrays["own_rows"]] = arrays["own_next_observation"]
        columns = {**arrays, "next_observation": next_observation}
        valid = np.arange(chunk.start, chunk.stop)
        valid = valid[valid >= added - buffer.capacity]
        for name in buffer.COLUMNS:
            rows = torch.from_numpy(columns[name][valid - chunk.start]).to(buffer.device)
            getattr(buffer, name)[torch.from_numpy(valid % buffer.capacity).to(buffer.device)] = rows


def _starts(buffer: ReplayBuffer) -> range:
    oldest = buffer.added - len(buffer)
    return range(oldest - oldest % CHUNK_ROWS, buffer.added, CHUNK_ROWS)


def _columns(buffer: ReplayBuffer, first: int, stop: int, stride: int) -> dict[str, np.ndarray[Any, Any]]:
    rows = torch.arange(first, stop, device=buffer.device) % buffer.capacity
    column = {name: getattr(buffer, name)[rows].cpu().numpy() for name in buffer.COLUMNS}
    following, observed = column.pop("next_observation"), column["observation"]
    own = np.ones(stop - first, dtype=bool)
    own[:-stride] = (following[:-stride] != observed[stride:]).any(-1)
    own_rows = np.flatnonzero(own)
    return {**column, "own_rows": own_rows, "own_next_observation": following[own_rows]}


def _address(put: dict[str, str]) -> dict[str, str]:
    return {"key": put["key"], "checksum": put["sha256"]}
