"""Serving: the port is taken clearly or not at all, and the address says the token."""

from __future__ import annotations

import threading
from pathlib import Path

import httpx2
import pytest

from labels_db.data_folder import DataFolder
from server import serve
from server.token import access_token


def test_a_taken_port_is_named() -> None:
    with serve.listen("127.0.0.1", 0) as taken:
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(serve.PortTakenError, match=rf"127\.0\.0\.1:{port}: .*--port"):
            serve.listen("127.0.0.1", port)


def test_it_announces_itself_once_it_answers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    data, urls, began = DataFolder(tmp_path), [], threading.Event()
    servers: list[serve._Announcing] = []
    make = serve._Announcing.__init__

    def remember(server: serve._Announcing, *args: object) -> None:
        servers.append(server)
        make(server, *args)  # type: ignore[arg-type]

    def ready(url: str) -> None:
        urls.append(url)
        began.set()

    monkeypatch.setattr(serve._Announcing, "__init__", remember)
    thread = threading.Thread(target=serve.serve, args=(data,), kwargs={"port": 0, "ready": ready})
    thread.start()
    try:
        assert began.wait(10)
        assert urls[0].endswith(f"/?token={access_token(data)}")
        assert httpx2.get(urls[0], follow_redirects=True).status_code == 200
    finally:
        servers[0].should_exit = True
        thread.join(10)
    assert not thread.is_alive()
