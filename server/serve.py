"""Serving the application from this process."""

from __future__ import annotations

import socket
from collections.abc import Callable, Collection

import uvicorn

from labels_db.data_folder import DataFolder
from server.app import create_app
from server.token import access_token

EVERYWHERE = {"0.0.0.0": "127.0.0.1", "::": "[::1]"}
"""Addresses that mean all of this machine's, and the one to reach it by; no browser should call it by those."""


class PortTakenError(Exception):
    """Another program listens where this one was asked to."""


def serve(
    data: DataFolder,
    *,
    host: str = "127.0.0.1",
    port: int = 8000,
    hosts: Collection[str] = (),
    ready: Callable[[str], None] | None = None,
) -> None:
    """Serve until a signal ends it; `ready` gets the address with its token once connections are taken.

    `hosts` are names the server answers to besides this machine's own. Port 0 takes any free one.
    """
    listener = listen(host, port)
    url = f"{_address(listener)}/?token={access_token(data)}"
    app = create_app(data, hosts={host, *hosts} - EVERYWHERE.keys())
    # Our own access log leaves queries out (`server/access_log.py`); no proxy in front is trusted.
    config = uvicorn.Config(app, log_level="warning", access_log=False, proxy_headers=False)
    with listener:
        _Announcing(config, lambda: ready and ready(url)).run(sockets=[listener])


def listen(host: str, port: int) -> socket.socket:
    """A bound socket; PortTakenError names the way out."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
    except OSError as error:
        listener.close()
        raise PortTakenError(f"{host}:{port}: {error.strerror}. Choose another port with --port.") from error
    return listener


def _address(listener: socket.socket) -> str:
    host, port = listener.getsockname()[:2]
    # Every address of this machine has no name of its own; the local one reaches it.
    name = EVERYWHERE.get(host) or (f"[{host}]" if ":" in host else host)
    return f"http://{name}:{port}"


class _Announcing(uvicorn.Server):
    """A server that says when it takes connections."""

    def __init__(self, config: uvicorn.Config, ready: Callable[[], object]) -> None:
        super().__init__(config)
        self._ready = ready

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if self.started:
            self._ready()
