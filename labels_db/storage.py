"""The artifact store: clips, segments, chunks, checkpoints, videos, under plain keys.

A local folder by default; any fsspec address otherwise. A key is either absent or whole: local files are
written under a temporary name, synced, then renamed; object stores do the same by themselves.
"""

from __future__ import annotations

import hashlib
import os
import re
import secrets
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

import fsspec
from fsspec.implementations.local import LocalFileSystem

_KEY = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*(/[A-Za-z0-9][A-Za-z0-9._-]*)*")


class ArtifactError(Exception):
    """An artifact is missing, damaged, or named by an impossible key."""


def sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


class ArtifactStore:
    """Bytes by key, as in `runs/windmill-3f/clips/a1-s0-q3-first.webp`."""

    def __init__(self, url: str) -> None:
        self._files, self._root = fsspec.url_to_fs(url)
        self._local = isinstance(self._files, LocalFileSystem)

    def write(self, key: str, data: bytes) -> str:
        """Store the bytes durably under the key; returns their SHA-256."""
        path = self._path(key)
        if self._local:
            _write_durably(Path(path), data)
        else:
            self._files.pipe_file(path, data)
        return sha256(data)

    def read(self, key: str, checksum: str | None = None) -> bytes:
        """The bytes under the key; ArtifactError when absent, or when they do not match `checksum`."""
        try:
            data: bytes = self._files.cat_file(self._path(key))
        except FileNotFoundError as error:
            raise ArtifactError(f"artifact {key}: missing from {self._root}") from error
        if checksum is not None and sha256(data) != checksum:
            raise ArtifactError(f"artifact {key}: damaged (its SHA-256 is not the recorded {checksum[:12]}…)")
        return data

    def exists(self, key: str) -> bool:
        return bool(self._files.isfile(self._path(key)))

    def keys(self, prefix: str) -> Iterator[str]:
        """Every key below a folder."""
        for path in self._files.find(self._path(prefix)):
            key = str(PurePosixPath(path).relative_to(self._root))
            if _KEY.fullmatch(key):  # a temporary file that a killed writer left is none
                yield key

    def delete(self, key: str) -> None:
        """Remove the key, if it is there."""
        if self.exists(key):
            self._files.rm_file(self._path(key))

    def _path(self, key: str) -> str:
        if not _KEY.fullmatch(key):
            raise ArtifactError(f"artifact key {key!r}: only letters, digits, '.', '_', '-' between slashes")
        return f"{self._root}/{key}"


def _write_durably(path: Path, data: bytes) -> None:
    """Temporary name, sync, rename, sync of the folder: after a crash the file is there whole or not."""
    _make_folder(path.parent)
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    try:
        with temporary.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        temporary.rename(path)
    finally:
        temporary.unlink(missing_ok=True)
    _sync_folder(path.parent)


def _make_folder(folder: Path) -> None:
    """Like `mkdir -p`, and what it makes outlasts a crash."""
    if not folder.is_dir():
        _make_folder(folder.parent)
        folder.mkdir(exist_ok=True)
        _sync_folder(folder.parent)


def _sync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
