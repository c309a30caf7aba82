"""Serving: the port is taken clearly or not at all, and the address says the token."""

from __future__ import annotations

from pathlib import Path

import httpx2
import pytest

from labels_db.data_folder import DataFolder
from server import serve
from server.token import access_token
from tests.serving import served


def test_a_taken_port_is_named() -> None:
    with serve.listen("127.0.0.1", 0) as taken:
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(serve.PortTakenError, match=rf"127\.0\.0\.1:{port}: .*--port"):
            serve.listen("127.0.0.1", port)


def test_it_announces_itself_once_it_answers(tmp_path: Path) -> None:
    data = DataFolder(tmp_path)
    with served(data) as url:
        assert url.endswith(f"/?token={access_token(data)}")
        assert httpx2.get(url, follow_redirects=True).status_code == 200
