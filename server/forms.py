"""Reading what an HTML form sent."""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, Request


async def _typed(request: Request) -> dict[str, str]:
    async with request.form(max_files=0, max_fields=500) as form:
        return {name: value for name, value in form.items() if isinstance(value, str)}


Typed = Annotated[dict[str, str], Depends(_typed)]
"""The form's text by field name; of a field sent twice, the later (a ticked box after its hidden "no")."""


def local_path(back: str) -> str:
    """The path as a place of this site: with one slash at its front, or `//other.example` would lead away."""
    return "/" + back.replace("\\", "/").lstrip("/")
