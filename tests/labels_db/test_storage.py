"""Artifacts: whole or absent, checked when read, under plain keys only."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from labels_db.data_folder import DataFolder
from labels_db.storage import ArtifactError, ArtifactStore, sha256

KEY = "runs/mill/clips/a1-s0-q3-first.webp"


class Killed(BaseException):
    """Stands for the process ending there and then."""


@pytest.fixture(params=["local", "memory"])
def any_store(request: pytest.FixtureRequest, tmp_path: Path) -> ArtifactStore:
    """A local folder, and a store without folders."""
    return ArtifactStore(str(tmp_path) if request.param == "local" else f"memory://{tmp_path.name}")


def test_what_is_written_is_read(any_store: ArtifactStore) -> None:
    checksum = any_store.write(KEY, b"frames")
    assert checksum == sha256(b"frames")
    assert any_store.read(KEY) == b"frames"
    assert any_store.read(KEY, checksum) == b"frames"
    assert any_store.exists(KEY)


def test_writing_again_replaces(any_store: ArtifactStore) -> None:
    any_store.write(KEY, b"old, and longer")
    any_store.write(KEY, b"new")
    assert any_store.read(KEY) == b"new"


def test_keys_are_listed_below_a_folder(any_store: ArtifactStore) -> None:
    for key in ("runs/one/a", "runs/one/deep/b", "runs/two/c"):
        any_store.write(key, b"")
    assert sorted(any_store.keys("runs/one")) == ["runs/one/a", "runs/one/deep/b"]
    assert sorted(any_store.keys("runs")) == ["runs/one/a", "runs/one/deep/b", "runs/two/c"]
    assert list(any_store.keys("nothing")) == []


def test_deleting_is_done_once_or_twice(any_store: ArtifactStore) -> None:
    any_store.write(KEY, b"")
    any_store.delete(KEY)
    any_store.delete(KEY)
    assert not any_store.exists(KEY)


def test_a_missing_artifact_is_named(any_store: ArtifactStore) -> None:
    with pytest.raises(ArtifactError, match=f"artifact {KEY}: missing from"):
        any_store.read(KEY)


def test_damage_is_found(store: ArtifactStore, data: DataFolder) -> None:
    checksum = store.write(KEY, b"frames")
    (data.path / "artifacts" / KEY).write_bytes(b"frame?")
    with pytest.raises(ArtifactError, match=f"artifact {KEY}: damaged"):
        store.read(KEY, checksum)


BAD_KEYS = [
    "",
    "..",
    "../x",
    "a/../b",
    "/etc/x",
    "a//b",
    "a/",
    ".hidden",
    "a/.b",
    "a b",
    "a\\b",
    "a\n",
    "ä",
    "a:b",
]


@pytest.mark.parametrize("key", BAD_KEYS)
def test_keys_that_could_leave_the_store_are_refused(store: ArtifactStore, key: str) -> None:
    for use in (
        store.read,
        store.exists,
        store.delete,
        lambda key: store.write(key, b""),
        lambda key: [*store.keys(key)],
    ):
        with pytest.raises(ArtifactError, match="only letters, digits"):
            use(key)


@pytest.mark.parametrize("moment", ["fsync", "rename"])
def test_a_write_that_is_cut_short_shows_nothing(
    store: ArtifactStore, monkeypatch: pytest.MonkeyPatch, moment: str
) -> None:
    store.write("runs/mill/other", b"")
    _die_at(monkeypatch, moment)
    with pytest.raises(Killed):
        store.write(KEY, b"frames")
    assert not store.exists(KEY)
    assert list(store.keys("runs")) == ["runs/mill/other"]


@pytest.mark.parametrize("moment", ["fsync", "rename"])
def test_an_overwrite_that_is_cut_short_keeps_the_old(
    store: ArtifactStore, monkeypatch: pytest.MonkeyPatch, moment: str
) -> None:
    checksum = store.write(KEY, b"old")
    _die_at(monkeypatch, moment)
    with pytest.raises(Killed):
        store.write(KEY, b"new")
    assert store.read(KEY, checksum) == b"old"


def _die_at(monkeypatch: pytest.MonkeyPatch, moment: str) -> None:
    """End the process, as far as files are concerned, before that call: nothing is tidied up afterwards."""

    def die(*_arguments: object) -> None:
        raise Killed

    monkeypatch.setattr(os if moment == "fsync" else Path, moment, die)
    monkeypatch.setattr(Path, "unlink", lambda *_arguments, **_options: None)


def test_a_temporary_file_left_behind_is_no_artifact(store: ArtifactStore, data: DataFolder) -> None:
    store.write(KEY, b"")
    (data.path / "artifacts" / "runs" / "mill" / "clips" / ".x.webp.1234").write_bytes(b"half")
    assert list(store.keys("runs")) == [KEY]


def test_the_folder_may_be_elsewhere(tmp_path: Path) -> None:
    data = DataFolder(tmp_path / "data", artifacts_url=str(tmp_path / "big-disk"))
    data.open_store().write(KEY, b"frames")
    assert (tmp_path / "big-disk" / KEY).read_bytes() == b"frames"
