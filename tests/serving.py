"""A real server on a data folder, in a thread of its own."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest
import uvicorn

from labels_db.data_folder import DataFolder
from server import serve


@contextmanager
def served(data: DataFolder) -> Iterator[str]:
    """The address that it announces once it answers; afterwards it has ended."""
    urls: list[str] = []
    servers: list[serve._Announcing] = []
    began, make = threading.Event(), serve._Announcing.__init__

    def remember(server: serve._Announcing, config: uvicorn.Config, ready: Callable[[], object]) -> None:
        servers.append(server)
        make(server, config, ready)

    def ready(url: str) -> None:
        urls.append(url)
        began.set()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(serve._Announcing, "__init__", remember)
        thread = threading.Thread(target=serve.serve, args=(data,), kwargs={"port": 0, "ready": ready})
        thread.start()
        try:
            assert began.wait(20)
            yield urls[0]
        finally:
            servers[0].should_exit = True
            thread.join(20)
        assert not thread.is_alive()
