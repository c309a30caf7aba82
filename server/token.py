"""The access token of one installation: made once, kept in the data folder, readable by its owner only."""

from __future__ import annotations

import os
import secrets
import tempfile
from pathlib import Path

from labels_db.data_folder import DataFolder


def access_token(data: DataFolder) -> str:
    """The installation's token, made when there is none."""
    path = data.token_path
    if not path.exists():
        _store(path, secrets.token_urlsafe(24), replace=False)
    # An emptied file must not mean that the empty token opens everything.
    return path.read_text(encoding="ascii").strip() or renew_token(data)


def renew_token(data: DataFolder) -> str:
    """A new token in place of the old, whose links, cookies and clients are refused from now on."""
    _store(data.token_path, secrets.token_urlsafe(24), replace=True)
    return access_token(data)


def _store(path: Path, token: str, *, replace: bool) -> None:
    """Write beside, then move there: nobody ever reads half a token, and of two who make one, one wins."""
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor, temporary = tempfile.mkstemp(dir=path.parent, prefix=".token-")  # mode 0600
    try:
        with os.fdopen(descriptor, "w", encoding="ascii") as file:
            file.write(token + "\n")
            file.flush()
            os.fsync(file.fileno())
        (_move if replace else _link)(Path(temporary), path)
    finally:
        Path(temporary).unlink(missing_ok=True)


def _move(temporary: Path, path: Path) -> None:
    temporary.replace(path)


def _link(temporary: Path, path: Path) -> None:
    try:
        path.hardlink_to(temporary)
    except FileExistsError:
        return


class TokenFile:
    """The present token, read again whenever the file has changed: a renewal reaches a running server."""

    def __init__(self, data: DataFolder) -> None:
        self._data = data
        self._seen: tuple[int, int] | None = None
        self._token = ""

    def current(self) -> str:
        try:
            status = self._data.token_path.stat()
        except FileNotFoundError:
            self._seen, self._token = None, access_token(self._data)
            return self._token
        if (status.st_mtime_ns, status.st_ino) != self._seen:
            self._token = access_token(self._data)
            self._seen = (status.st_mtime_ns, status.st_ino)
        return self._token
