"""The commands that README, CONTRIBUTING and CI name are there, and CI runs what people run."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TARGETS = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
TEXTS = ["README.md", "CONTRIBUTING.md", *(f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md"))]


@pytest.mark.parametrize("target", ["setup", "run", "test", "check", "contracts", "demo-human", "clean"])
def test_there_is_a_command(target: str) -> None:
    assert target in TARGETS


@pytest.mark.parametrize("text", TEXTS)
def test_texts_name_commands_that_exist(text: str) -> None:
    named = set(re.findall(r"`make ([a-z-]+)", (ROOT / text).read_text(encoding="utf-8")))
    assert named <= TARGETS


def test_checking_includes_every_tool() -> None:
    commands = subprocess.run(
        ["make", "--dry-run", "--no-print-directory", "check"], cwd=ROOT, capture_output=True, text=True
    )
    assert commands.returncode == 0
    for command in ("ruff format --check .", "ruff check .", "mypy", "pytest"):
        assert command in commands.stdout


@pytest.mark.parametrize("status", [0, 7])
def test_ci_ends_as_the_check_ends(tmp_path: Path, status: int) -> None:
    (tmp_path / ".ci").mkdir()
    shutil.copy(ROOT / ".ci" / "run", tmp_path / ".ci")
    (tmp_path / "Makefile").write_text(f"check:\n\t@cat; exit {status}\n", encoding="utf-8")
    environment = {"PATH": os.environ["PATH"], "CI": "true"}
    result = subprocess.run(
        [tmp_path / ".ci" / "run"], env=environment, input="typed", capture_output=True, text=True
    )
    assert bool(result.returncode) is bool(status)
    assert "typed" not in result.stdout
