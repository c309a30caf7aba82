"""The access token: private, stable, and gone at once when renewed."""

from __future__ import annotations

import stat
from pathlib import Path

from labels_db.data_folder import DataFolder
from server.token import TokenFile, access_token, renew_token


def test_it_is_made_once_for_its_owner_only(tmp_path: Path) -> None:
    data = DataFolder(tmp_path / "new")
    token = access_token(data)
    assert len(token) >= 32
    assert access_token(data) == token
    assert stat.S_IMODE(data.token_path.stat().st_mode) == 0o600
    assert [path.name for path in data.path.iterdir()] == ["token"]


def test_a_renewed_one_is_seen_by_those_who_read_the_old(tmp_path: Path) -> None:
    data = DataFolder(tmp_path)
    tokens = TokenFile(data)
    old = tokens.current()
    new = renew_token(data)
    assert new != old
    assert tokens.current() == new
    assert stat.S_IMODE(data.token_path.stat().st_mode) == 0o600


def test_a_lost_one_is_made_anew(tmp_path: Path) -> None:
    data = DataFolder(tmp_path)
    tokens = TokenFile(data)
    old = tokens.current()
    data.token_path.unlink()
    assert tokens.current() not in ("", old)
    assert tokens.current() == access_token(data)


def test_an_emptied_one_opens_nothing(tmp_path: Path) -> None:
    data = DataFolder(tmp_path)
    data.token_path.write_text("\n")
    assert access_token(data) != ""
