"""Who may come in: bearer tokens, and the signed cookie that a browser gets for the token."""

from __future__ import annotations

import hashlib
import hmac

from itsdangerous import BadSignature, URLSafeTimedSerializer
from starlette.requests import Request
from starlette.responses import Response

from server.token import TokenFile

COOKIE_SECONDS = 90 * 24 * 3600


class Admission:
    """Cookies signed with a key that comes from the token: a renewed token ends them all at once."""

    def __init__(self, tokens: TokenFile) -> None:
        self._tokens = tokens

    def is_token(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(), self._tokens.current().encode())

    def has_bearer(self, request: Request) -> bool:
        scheme, _, given = request.headers.get("authorization", "").partition(" ")
        return scheme.lower() == "bearer" and self.is_token(given.strip())

    def has_cookie(self, request: Request) -> bool:
        value = request.cookies.get(self._cookie_name())
        if value is None:
            return False
        try:
            self._serializer().loads(value, max_age=COOKIE_SECONDS)
        except BadSignature:
            return False
        return True

    def sign_in(self, request: Request, response: Response) -> None:
        """Give the browser its cookie."""
        response.set_cookie(
            self._cookie_name(),
            self._serializer().dumps("operator"),
            max_age=COOKIE_SECONDS,
            secure=request.url.scheme == "https",
            httponly=True,
            samesite="lax",
        )

    def _cookie_name(self) -> str:
        # Cookies ignore ports: without this, two installations on one machine would sign each other out.
        return "pebble_" + hashlib.sha256(b"cookie name" + self._tokens.current().encode()).hexdigest()[:8]

    def _serializer(self) -> URLSafeTimedSerializer:
        return URLSafeTimedSerializer(self._tokens.current(), salt="pebble session")
