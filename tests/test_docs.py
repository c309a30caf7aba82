"""The documentation says what is so: settings, commands, variables, files."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from typer.main import get_group

from benchmarks.speed.__main__ import everything
from benchmarks.speed.table import table
from cli.main import app
from scripts.make_configuration_reference import TARGET, reference

ROOT = Path(__file__).parent.parent
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), *(ROOT / "benchmarks").glob("*.md")])
TEXT = "\n".join(page.read_text(encoding="utf-8") for page in PAGES)


def test_the_configuration_reference_is_what_the_classes_say() -> None:
    assert TARGET.read_text(encoding="utf-8") == reference(), (
        "run python -m scripts.make_configuration_reference"
    )


def test_every_command_is_shown_somewhere() -> None:
    commands = get_group(app).commands
    missing = [name for name in commands if f"pebble {name}" not in TEXT]
    assert missing == []


def test_every_environment_variable_is_explained() -> None:
    sources = [*ROOT.glob("cli/*.py"), *ROOT.glob("server/*.py"), *ROOT.glob("docker-compose.yml")]
    used = set(re.findall(r"PEBBLE_[A-Z_]+", "\n".join(path.read_text() for path in sources)))
    assert {name for name in used if name not in TEXT} == set()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_to_files_lead_somewhere(page: Path) -> None:
    links = re.findall(r"\]\((?!https?:|#)([^)#]+)", page.read_text(encoding="utf-8"))
    assert [link for link in links if not (page.parent / link).exists()] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_shown_with_options_take_them(page: Path) -> None:
    commands = get_group(app).commands
    for line in re.findall(r"^\s*pebble (.+?)(?:\s+#.*)?$", page.read_text(encoding="utf-8"), re.MULTILINE):
        name, *words = line.split()
        known = {option for parameter in commands[name].params for option in parameter.opts}
        assert {word.partition("=")[0] for word in words if word.startswith("--")} <= known, line


def test_the_table_of_speeds_is_what_was_measured() -> None:
    """Every row that is measured, with what a reader compares; the page's table is the same."""
    results = ROOT / "benchmarks" / "results"
    measured = json.loads((results / "speed.json").read_text(encoding="utf-8"))
    assert [row["name"] for row in measured["rows"]] == list(everything(None))
    for row in measured["rows"]:
        assert {"name", "unit", "ours", "best_peer", "ratio", "limit_fraction"} <= set(row), row["name"]
    assert {"processor", "torch", "python"} <= set(measured["machine"])
    shown = table(measured["rows"])
    assert (results / "speed.md").read_text(encoding="utf-8") == shown
    assert shown in (ROOT / "benchmarks" / "README.md").read_text(encoding="utf-8")
