"""Where errors become status codes, here and nowhere else: JSON under /api, a page elsewhere."""

from __future__ import annotations

from collections.abc import Callable
from http import HTTPStatus

from fastapi import FastAPI
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from labels_db.errors import ChoiceError, ConflictError, NotFoundError
from labels_db.overrides import SettingError
from labels_db.storage import ArtifactError
from server.security import HEADERS
from server.templating import render

TITLES = {
    403: "Not from here",
    404: "Nothing here",
    405: "Not that way",
    409: "Not now",
    413: "Too large",
    422: "Something does not fit",
    500: "That went wrong",
}


def complain(
    request: Request, status: int, reason: str, *, field: str = "", headers: dict[str, str] | None = None
) -> Response:
    """The answer to a request that cannot be met: what was wrong and, where one is to blame, which field."""
    if status == 401:
        headers = {"WWW-Authenticate": "Bearer", **(headers or {})}
    if request.url.path.startswith("/api"):
        detail = {"detail": [{"field": field, "reason": reason}]}
        return JSONResponse(detail, status_code=status, headers=headers)
    if status == 401:
        return sign_in_page(request, reason, _here(request), headers=headers)
    title = TITLES.get(status) or HTTPStatus(status).phrase
    blamed = "" if status == 404 else field  # what is not there is named by the reason itself
    return render(
        request, "error.html", status=status, headers=headers, title=title, field=blamed, reason=reason
    )


def sign_in_page(
    request: Request, reason: str, back: str, *, headers: dict[str, str] | None = None
) -> Response:
    """The page that asks for the token, and goes back to the one that wanted it."""
    return render(request, "sign_in.html", status=401, headers=headers, reason=reason, back=back)


def _here(request: Request) -> str:
    """The address asked for, to come back to; a token in it has just been refused."""
    query = "" if "token" in request.query_params else request.url.query
    return f"{request.url.path}?{query}" if query else request.url.path


def install(app: FastAPI) -> None:
    """Give every error that a handler may raise its answer."""
    app.exception_handler(NotFoundError)(_not_found)
    app.exception_handler(ArtifactError)(_of(404))
    app.exception_handler(ConflictError)(_of(409))
    app.exception_handler(ChoiceError)(_of(422))
    app.exception_handler(SettingError)(_setting)
    app.exception_handler(HTTPException)(_http)
    app.exception_handler(RequestValidationError)(_request)
    app.exception_handler(Exception)(_unexpected)


def _of(status: int) -> Callable[[Request, Exception], Response]:
    def handler(request: Request, error: Exception) -> Response:
        return complain(request, status, str(error))

    return handler


def _not_found(request: Request, error: Exception) -> Response:
    assert isinstance(error, NotFoundError)
    return complain(request, 404, str(error), field=error.field)


def _setting(request: Request, error: Exception) -> Response:
    assert isinstance(error, SettingError)
    return complain(request, 422, error.message, field=error.path)


def _http(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    reason = "There is no such page." if error.status_code == 404 else str(error.detail)
    headers = dict(error.headers or {})
    return complain(request, error.status_code, reason, headers=headers)


def _request(request: Request, error: Exception) -> Response:
    """The first complaint of the request's own validation, with the path of the field in the request."""
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    field = ".".join(str(part) for part in first["loc"][1:]) or str(first["loc"][0])
    return complain(request, 422, first["msg"].removeprefix("Value error, "), field=field)


def _unexpected(request: Request, _error: Exception) -> Response:
    # Answered outside of the gate, which adds these to everything else.
    return complain(
        request,
        500,
        "Pebble could not do that. The server's log says why.",
        headers={**HEADERS, "Cache-Control": "no-store"},
    )
