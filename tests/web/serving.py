"""The real application, served by a thread of the test's own process."""

from __future__ import annotations

import threading
import time
from collections.abc import Collection

import uvicorn

from labels_db.data_folder import DataFolder
from server.app import create_app
from server.serve import listen


class Serving:
    """The application on one port, which it keeps over restarts; `hosts` may change between them."""

    def __init__(self, data: DataFolder, hosts: Collection[str] = ()) -> None:
        self.data = data
        self.hosts = hosts
        self.port = 0

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def start(self) -> None:
        """Returns once connections are taken."""
        listener = listen("127.0.0.1", self.port)
        self.port = listener.getsockname()[1]
        config = uvicorn.Config(
            create_app(self.data, hosts=self.hosts), log_level="critical", access_log=False
        )
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(target=self._server.run, kwargs={"sockets": [listener]})
        self._thread.start()
        while not self._server.started:
            assert self._thread.is_alive(), "the application did not start"
            time.sleep(0.01)

    def stop(self) -> None:
        self._server.should_exit = True
        self._thread.join(timeout=10)
