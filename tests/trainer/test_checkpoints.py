"""Checkpoints give everything back, share what does not change, and survive damage."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from labels_db.models import RunState
from labels_db.records import checkpoints_of, forget_checkpoints
from labels_db.storage import ArtifactStore
from tests.trainer.conftest import RUN, Lab, small_config
from tests.trainer.given import lived
from trainer import buffer_chunks
from trainer.buffer_chunks import BufferChunks
from trainer.checkpoints import KEPT, CheckpointError, Checkpoints, keys_of
from trainer.replay_buffer import ReplayBuffer
from trainer.state_tree import pack, unpack


def test_a_state_tree_comes_back_bit_for_bit_through_json() -> None:
    network = torch.nn.Linear(3, 2)
    optimizer = torch.optim.Adam(network.parameters())
    network(torch.ones(1, 3)).sum().backward()
    optimizer.step()
    tree = {
        "optimizer": optimizer.state_dict(),
        "generator": torch.Generator().manual_seed(1).get_state(),
        "numpy": np.random.default_rng(0).bit_generator.state,
        "numbers": {"step": 3, "mean": 0.1 + 0.2, "none": None, "list": [1, [2.5, np.arange(3)]]},
    }
    values, arrays = pack(tree)
    back = unpack(json.loads(json.dumps(values)), arrays)
    assert back["numbers"]["mean"] == 0.1 + 0.2
    assert back["numpy"] == tree["numpy"]
    np.testing.assert_array_equal(back["numbers"]["list"][1][1], np.arange(3))
    torch.testing.assert_close(back["generator"], tree["generator"], rtol=0, atol=0)
    again = torch.optim.Adam(network.parameters())
    again.load_state_dict(back["optimizer"])
    for name, value in optimizer.state_dict()["state"][0].items():
        torch.testing.assert_close(again.state_dict()["state"][0][name], value, rtol=0, atol=0)


def fill(buffer: ReplayBuffer, count: int, envs: int, rng: np.random.Generator, episode: int = 7) -> None:
    """Transitions of `envs` chains, which begin anew every `episode` steps."""
    state = rng.normal(size=(envs, 2)).astype(np.float32)
    for step in range(count):
        following = rng.normal(size=(envs, 2)).astype(np.float32)
        numbers = rng.normal(size=(envs, 2)).astype(np.float32)
        ended = np.array([step % 5 == 0] * envs)
        buffer.remember(lived(state, numbers[:, :1], following, ended), torch.from_numpy(numbers[:, 1]))
        state = rng.normal(size=(envs, 2)).astype(np.float32) if step % episode == 0 else following


@given(
    capacity=st.integers(20, 60),
    counts=st.lists(st.integers(1, 40), min_size=1, max_size=4),
    envs=st.integers(1, 3),
)
def test_a_buffer_comes_back_whatever_its_ring_holds(
    tmp_path_factory: pytest.TempPathFactory, capacity: int, counts: list[int], envs: int
) -> None:
    rng = np.random.default_rng(capacity)
    store = ArtifactStore(str(tmp_path_factory.mktemp("chunks")))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(buffer_chunks, "CHUNK_ROWS", 16)
        buffer, chunks = ReplayBuffer(capacity, 2, 1), BufferChunks(store, "chunks", envs)
        for count in counts:
            fill(buffer, count, envs, rng)
            manifest = json.loads(json.dumps(chunks.save(buffer)))
        restored = ReplayBuffer(capacity, 2, 1)
        BufferChunks(store, "chunks", envs).load(restored, manifest)
    assert restored.added == buffer.added
    for name in (*buffer.COLUMNS, "reward"):
        np.testing.assert_array_equal(
            getattr(restored, name)[: len(buffer)].numpy(), getattr(buffer, name)[: len(buffer)].numpy()
        )


def test_a_checkpoint_costs_its_new_rows_only(store: ArtifactStore, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(buffer_chunks, "CHUNK_ROWS", 50)
    buffer, chunks = ReplayBuffer(1000, 2, 1), BufferChunks(store, "chunks", 1)
    fill(buffer, 220, 1, np.random.default_rng(0))
    before = chunks.save(buffer)
    written = set(store.keys("chunks"))
    fill(buffer, 30, 1, np.random.default_rng(1))
    after = chunks.save(buffer)
    assert [c["key"] for c in after["chunks"][:4]] == [c["key"] for c in before["chunks"][:4]]
    assert len(set(store.keys("chunks")) - written) == 2  # the last chunk and the rewards


def test_a_torn_chunk_is_written_again(store: ArtifactStore) -> None:
    buffer, chunks = ReplayBuffer(100, 2, 1), BufferChunks(store, "chunks", 1)
    fill(buffer, 60, 1, np.random.default_rng(0))
    (torn,) = chunks.save(buffer)["chunks"]
    store.write(torn["key"], b"torn")
    manifest = BufferChunks(store, "chunks", 1).save(buffer)  # a later attempt
    BufferChunks(store, "chunks", 1).load(ReplayBuffer(100, 2, 1), manifest)


def test_old_checkpoints_go_with_what_only_they_needed(lab: Lab) -> None:
    lab.request(small_config(total_steps=1200, checkpoints__keep_buffer=True))
    lab.live()
    with lab.database.read() as session:
        kept = checkpoints_of(session, RUN)
    assert len(kept) == KEPT
    needed = {c.manifest_key for c in kept}
    for checkpoint in kept:
        needed |= keys_of(json.loads(lab.store.read(checkpoint.manifest_key)))
    assert set(lab.store.keys(f"runs/{RUN}/checkpoints")) == needed


def test_what_a_later_attempt_has_written_is_not_swept(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    """An attempt that was suspended after the record said that the run was its own."""
    written: list[str] = []

    def forget_and_sleep(*arguments: Any) -> None:
        forget_checkpoints(*arguments)
        written.append(f"runs/{RUN}/checkpoints/of-the-next-{len(written)}")
        lab.store.write(written[-1], b"new")

    monkeypatch.setattr("trainer.checkpoints.forget_checkpoints", forget_and_sleep)
    lab.request(small_config())
    assert lab.live() is RunState.FINISHED
    assert lab.store.exists(written[-1])


def test_a_finished_run_keeps_its_networks_and_drops_its_rows(lab: Lab) -> None:
    lab.request(small_config())
    lab.live()
    names = [key.rpartition("/")[2] for key in lab.store.keys(f"runs/{RUN}/checkpoints")]
    assert sorted(name.rpartition(".")[2] for name in names) == ["json", "safetensors"]


def test_a_damaged_checkpoint_falls_back_to_the_one_before(lab: Lab) -> None:
    config = small_config(checkpoints__keep_buffer=True)
    lab.request(config)
    lab.live()
    with lab.database.read() as session:
        last, before = checkpoints_of(session, RUN)[:2]
    claim = type("Any", (), {"run_id": RUN, "attempt": 1})()
    saved = Checkpoints(lab.database, lab.store, claim, config)
    manifest = saved.latest()
    assert manifest is not None
    assert manifest["step"] == last.step
    lab.store.write(last.manifest_key, b"torn")
    manifest = saved.latest()
    assert manifest is not None
    assert manifest["step"] == before.step
    lab.store.delete(before.manifest_key)
    with pytest.raises(CheckpointError, match="none of its 2 checkpoints"):
        saved.latest()
