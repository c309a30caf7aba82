"""Templates and static files rest on nothing from elsewhere and carry no inline code."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from server.templating import WEB, static_version

OURS = [
    path
    for path in sorted(WEB.rglob("*"))
    if path.is_file() and "vendor" not in path.parts and path.suffix in {".html", ".css", ".js", ".svg"}
]
NAMESPACE = "http://www.w3.org/2000/svg"


@pytest.mark.parametrize("path", OURS, ids=lambda path: str(path.relative_to(WEB)))
def test_no_address_leads_elsewhere(path: Path) -> None:
    text = path.read_text(encoding="utf-8").replace(NAMESPACE, "")
    assert re.findall(r"(?:https?:)?//[a-z0-9-]+\.[a-z]{2,}[^\s\"']*", text) == []


@pytest.mark.parametrize("path", [p for p in OURS if p.suffix == ".html"], ids=lambda path: path.name)
def test_no_inline_script_or_style(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert re.findall(r"<script(?![^>]*\ssrc=)", text) == []
    assert re.findall(r"<style|\sstyle=|\son[a-z]+=|hx-on|javascript:|\|\s*safe\b", text) == []


def test_pages_link_every_style_sheet_and_nothing_else() -> None:
    pages = "".join(path.read_text(encoding="utf-8") for path in OURS if path.suffix == ".html")
    linked = set(re.findall(r"static\('([\w/.-]+\.css)'\)", pages))
    ours = {str(path.relative_to(WEB / "static")) for path in OURS if path.suffix == ".css"}
    assert ours == {path for path in linked if not path.startswith("vendor/")}


def test_what_is_vendored_has_its_licence() -> None:
    for folder in (WEB / "static" / "vendor").iterdir():
        assert (folder / "LICENSE").is_file(), folder


def test_the_version_follows_the_content(tmp_path: Path) -> None:
    (tmp_path / "a.css").write_text("a")
    before = static_version(tmp_path)
    (tmp_path / "a.css").write_text("b")
    assert static_version(tmp_path) != before
