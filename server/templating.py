"""Templates and static files: found beside this package, named by version so that browsers keep them."""

from __future__ import annotations

import functools
import hashlib
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.staticfiles import StaticFiles

from labels_db.numbers import number
from server import words

WEB = Path(__file__).resolve().parent.parent / "web"
FOREVER = "public, max-age=31536000, immutable"


def static_version(folder: Path = WEB / "static") -> str:
    """A short name for the present content of all static files."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*")):
        if path.is_file():
            digest.update(f"{path.relative_to(folder)}\0".encode() + path.read_bytes())
    return digest.hexdigest()[:12]


class VersionedFiles(StaticFiles):
    """Static files whose addresses change with their content: a browser need never ask twice."""

    def file_response(self, *args: Any, **kwargs: Any) -> Response:
        response = super().file_response(*args, **kwargs)
        response.headers["Cache-Control"] = FOREVER
        return response


def make_templates(version: str) -> Environment:
    """The page templates, with the words and numbers they are written in."""
    templates = Environment(
        loader=FileSystemLoader(WEB / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.globals["static"] = functools.partial("/static/{}/{}".format, version)
    for filter in (
        number,
        words.decimal,
        words.percent,
        words.plural,
        words.ago,
        words.exact,
        words.measure,
        words.figure,
        words.spread,
        words.measure_name,
        words.setting,
    ):
        templates.filters[filter.__name__] = filter
    return templates


def render(
    request: Request, name: str, *, status: int = 200, headers: dict[str, str] | None = None, **context: Any
) -> HTMLResponse:
    """The template as a page or fragment; `path` is the address asked for."""
    templates: Environment = request.app.state.templates
    text = templates.get_template(name).render(path=request.url.path, **context)
    return HTMLResponse(text, status_code=status, headers=headers)
