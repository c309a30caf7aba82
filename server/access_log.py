"""One line per request: method, path, status, time. Never the query, which may hold the token."""

from __future__ import annotations

import logging
import time

from starlette.types import ASGIApp, Message, Receive, Scope, Send

log = logging.getLogger("pebble.access")


class AccessLog:
    """Logs requests as they end."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        began, status = time.perf_counter(), 500  # what a handler's failure becomes further out

        async def sender(message: Message) -> None:
            nonlocal status
            status = message.get("status", status)
            await send(message)

        try:
            await self.app(scope, receive, sender)
        finally:
            spent = (time.perf_counter() - began) * 1000
            log.info("%s %s %d %.0f ms", scope["method"], scope["path"], status, spent)
