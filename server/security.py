"""The gate in front of every route: known host, small body, same site, token or cookie.

Pure ASGI, so that nothing gets past it and streams pass through untouched.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from urllib.parse import parse_qsl, urlencode, urlsplit

from starlette.datastructures import MutableHeaders
from starlette.requests import Request
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from server.admission import Admission
from server.forms import local_path

LOCAL_HOSTS = frozenset({"127.0.0.1", "localhost", "::1"})
MAX_BODY_BYTES = 64 * 1024
SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
PUBLIC_PREFIX = "/static/"
PUBLIC_PATHS = frozenset({"/healthz", "/sign-in"})

HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; media-src 'self';"
        " connect-src 'self'; form-action 'self'; frame-ancestors 'none'; base-uri 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    # Not `no-referrer`: with it browsers send `Origin: null` with forms, which would then be refused.
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=()",
}

Refuse = Callable[[Request, int, str], Response]


class Gate:
    """Lets a request through, or answers it with the reason why not."""

    def __init__(self, app: ASGIApp, *, admission: Admission, hosts: Collection[str], refuse: Refuse) -> None:
        self.app = app
        self.admission = admission
        self.hosts = LOCAL_HOSTS | {host.lower().strip("[]") for host in hosts}
        self.refuse = refuse

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        response = self._answer(Request(scope)) or self.app
        await response(scope, receive, _with_headers(send))

    def _answer(self, request: Request) -> Response | None:
        """The gate's own answer; None lets the request through."""
        host = _host_name(request)
        if host not in self.hosts:
            text = f"Host {host!r} is not served here. Start Pebble with --allow-host {host} to serve it."
            return PlainTextResponse(text, status_code=400)
        return self._body_problem(request) or self._site_problem(request) or self._entry(request)

    def _body_problem(self, request: Request) -> Response | None:
        if "transfer-encoding" in request.headers:
            return self.refuse(request, 411, "Send the length of the body (Content-Length).")
        length = request.headers.get("content-length", "0")
        if not length.isdecimal() or int(length) > MAX_BODY_BYTES:
            return self.refuse(request, 413, f"A body of {length} bytes: at most {MAX_BODY_BYTES} are taken.")
        return None

    def _site_problem(self, request: Request) -> Response | None:
        if request.method in SAFE_METHODS or _same_site(request):
            return None
        if not _names_its_site(request) and self.admission.has_bearer(request):
            return None
        return self.refuse(request, 403, "This request came from another site, so nothing was done.")

    def _entry(self, request: Request) -> Response | None:
        path = request.url.path
        if path.startswith(PUBLIC_PREFIX) or path in PUBLIC_PATHS:
            return None
        given = request.query_params.get("token")
        if given is not None and request.method in SAFE_METHODS and self.admission.is_token(given):
            return self._signed_in(request)
        if self.admission.has_cookie(request) or self.admission.has_bearer(request):
            return None
        return self.refuse(request, 401, _why_not(request, given))

    def _signed_in(self, request: Request) -> Response:
        """The same address without the token, which then stays out of history and bookmarks."""
        rest = [pair for pair in parse_qsl(request.url.query, keep_blank_values=True) if pair[0] != "token"]
        query = f"?{urlencode(rest)}" if rest else ""
        response = RedirectResponse(local_path(request.url.path) + query, status_code=303)
        self.admission.sign_in(request, response)
        return response


def _host_name(request: Request) -> str:
    try:
        return urlsplit(f"//{request.headers.get('host', '')}").hostname or ""
    except ValueError:
        return ""


def _names_its_site(request: Request) -> bool:
    return "sec-fetch-site" in request.headers or "origin" in request.headers


def _same_site(request: Request) -> bool:
    """Whether the browser says that one of our own pages sent this; a proxy in front may have spoken TLS with it."""
    site, origin = request.headers.get("sec-fetch-site"), request.headers.get("origin")
    if site is None and origin is None:
        return False
    host = request.headers.get("host", "")
    return site in (None, "same-origin") and origin in (None, f"http://{host}", f"https://{host}")


def _why_not(request: Request, given: str | None) -> str:
    if given is not None or "authorization" in request.headers:
        return "That token does not open this Pebble. It may have been renewed."
    return "This page needs the access token."


def _with_headers(send: Send) -> Send:
    async def sender(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in HEADERS.items():
                headers[name] = value
            # Pages and answers of the API are of the moment; clips, videos and static files say otherwise.
            headers.setdefault("Cache-Control", "no-store")
        await send(message)

    return sender
