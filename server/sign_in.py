"""Signing in: the form on the page that refuses, for people who have the token but not the link."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Form, Request
from starlette.responses import RedirectResponse, Response

from server.admission import Admission
from server.errors import sign_in_page
from server.forms import local_path

router = APIRouter(include_in_schema=False)


@router.post("/sign-in")
def sign_in(
    request: Request, token: Annotated[str, Form()] = "", back: Annotated[str, Form()] = "/"
) -> Response:
    """Take the token from the form and go back to the page that wanted it."""
    admission: Admission = request.app.state.admission
    if not admission.is_token(token.strip()):
        return sign_in_page(request, "That token does not open this Pebble. It may have been renewed.", back)
    response = RedirectResponse(local_path(back), status_code=303)
    admission.sign_in(request, response)
    return response


@router.get("/sign-in")
def form(request: Request) -> Response:
    """The form by itself."""
    return sign_in_page(request, "Pebble needs its access token.", "/")
