"""The house of docs/architecture.md: which room may import what, and what leaves it in a wheel."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hatchling.builders.wheel import WheelBuilder

ROOT = Path(__file__).parents[1]
ROOMS = ("labels_db", "server", "trainer", "cli")
STANDARD = sys.stdlib_module_names

RECORD = {"labels_db", "sqlalchemy", "alembic", "pydantic", "pydantic_core", "fsspec", "pysqlite3"}
HEAVY = {"torch", "mujoco", "dm_control", "numpy", "gymnasium", "trainer"}
MAY_NOT = {"server": HEAVY | {"cli"}, "trainer": {"server", "cli"}}


def _sources(room: str) -> list[Path]:
    return sorted((ROOT / room).rglob("*.py"))


def _imports(path: Path) -> Iterator[str]:
    """The packages that a file imports anywhere, also inside functions."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: relative import"
            yield (node.module or "").partition(".")[0]


def _everything_imported(room: str) -> dict[str, set[str]]:
    """Package → the room's files that import it."""
    found: dict[str, set[str]] = {}
    for path in _sources(room):
        for package in _imports(path):
            found.setdefault(package, set()).add(str(path.relative_to(ROOT)))
    return found


def test_the_record_stands_alone() -> None:
    imported = _everything_imported("labels_db")
    assert {package: files for package, files in imported.items() if package not in STANDARD | RECORD} == {}


@pytest.mark.parametrize(("room", "forbidden"), MAY_NOT.items(), ids=MAY_NOT)
def test_a_room_keeps_out_of_the_others(room: str, forbidden: set[str]) -> None:
    imported = _everything_imported(room)
    assert {package: files for package, files in imported.items() if package in forbidden} == {}


def test_there_is_no_drawer_for_odds_and_ends() -> None:
    names = {path.stem for room in ROOMS for path in _sources(room)}
    names |= {path.name for room in ROOMS for path in (ROOT / room).rglob("*") if path.is_dir()}
    assert names & {"utils", "util", "common", "helpers", "misc", "tools"} == set()


def _modules_after(statement: str) -> set[str]:
    """What a fresh process has imported after that statement."""
    code = f"import sys; {statement}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    return set(done.stdout.split())


@pytest.mark.parametrize("statement", ["import server.app", "import server.serve", "import cli.main"])
def test_what_must_start_fast_loads_nothing_heavy(statement: str) -> None:
    heavy = HEAVY - {"trainer"} if "cli" in statement else HEAVY
    assert _modules_after(statement) & heavy == set()


# What leaves the house ---------------------------------------------------------------------------


@pytest.fixture(scope="module")
def wheel() -> set[str]:
    """The files that a wheel would hold."""
    builder = WheelBuilder(str(ROOT))
    return {file.distribution_path for file in builder.recurse_included_files()}


@pytest.mark.parametrize("room", [*ROOMS, "web"])
def test_a_wheel_holds_every_file_of_every_room(wheel: set[str], room: str) -> None:
    files = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / room).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert files
    assert files - wheel == set()


def test_a_wheel_holds_what_is_no_python(wheel: set[str]) -> None:
    assert "labels_db/catalogue.json" in wheel
    assert "labels_db/migrations/env.py" in wheel
    assert "labels_db/migrations/script.py.mako" in wheel
    assert any(re.fullmatch(r"labels_db/migrations/versions/0001_\w+\.py", name) for name in wheel)
    assert any(name.startswith("web/templates/") for name in wheel)
    assert any(name.startswith("web/static/") for name in wheel)


def test_a_wheel_holds_nothing_else(wheel: set[str]) -> None:
    assert {name.split("/")[0] for name in wheel} == {*ROOMS, "web"}


# What the project says ---------------------------------------------------------------------------

NOT_OURS = {"build", "data", "test-results", "__pycache__"}
TEXTS = {".py", ".md", ".html", ".css", ".js", ".json", ".toml", ".yml", ".csv", ".svg", ".mako", ""}


def _texts() -> Iterator[Path]:
    for folder, names, files in os.walk(ROOT):
        names[:] = [name for name in names if name not in NOT_OURS and (name[0] != "." or name == ".ci")]
        yield from (path for path in map(Path(folder).joinpath, files) if path.suffix in TEXTS)


def test_no_text_names_a_folder_of_somebodys_machine() -> None:
    # Where people's files lie on Linux, macOS and Windows, and this checkout (unless it is as plain as /app).
    private = re.compile(r"(?<![\w.])/(?:home|root|Users)/\w|[A-Z]:\\\\?Users")
    checkout = str(ROOT) if len(ROOT.parts) > 2 else None
    named = {}
    for path in _texts():
        text = path.read_text(encoding="utf-8", errors="replace")
        found = private.search(text)
        if found or (checkout and checkout in text):
            named[path.relative_to(ROOT).as_posix()] = found.group() if found else checkout
    assert named == {}
