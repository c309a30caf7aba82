"""Who labels in this browser: a name in a cookie of its own, made up until somebody gives one."""

from __future__ import annotations

import re
import secrets
from dataclasses import dataclass
from typing import Annotated
from urllib.parse import quote, unquote

from fastapi import Depends, Request, Response
from pydantic import TypeAdapter, ValidationError

from server.labelling_models import PersonName

COOKIE = "pebble_labeller"
COOKIE_SECONDS = 400 * 24 * 3600  # the longest that browsers keep one
_MADE_UP = re.compile(r"Labeller [0-9a-f]{6}")
_NAME: TypeAdapter[str] = TypeAdapter(PersonName)


@dataclass(frozen=True)
class Person:
    """The labeller of this browser. Two browsers are two labellers until both go by the same name."""

    name: str
    known: bool

    @property
    def named(self) -> bool:
        """Whether somebody chose the name."""
        return not _MADE_UP.fullmatch(self.name)


def person_of(request: Request) -> Person:
    """The person whom the browser's cookie names, or a new one."""
    try:
        return Person(_NAME.validate_python(unquote(request.cookies.get(COOKIE, ""))), known=True)
    except ValidationError:
        return Person(f"Labeller {secrets.token_hex(3)}", known=False)


def remember(request: Request, response: Response, name: str) -> None:
    """Let the browser keep the name. It is no secret and opens nothing: the gate has its own cookie."""
    response.set_cookie(
        COOKIE,
        quote(name),
        max_age=COOKIE_SECONDS,
        secure=request.url.scheme == "https",
        httponly=True,
        samesite="lax",
    )


def _person(request: Request, response: Response) -> Person:
    person = person_of(request)
    if not person.known:
        remember(request, response, person.name)
    return person


PersonDep = Annotated[Person, Depends(_person)]
"""The person, remembered by the reply; a handler that makes its own response calls `remember` itself."""
