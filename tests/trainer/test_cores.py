"""How many cores there are for us."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from trainer.cores import available_cores


@pytest.mark.parametrize(
    ("allowed", "cores"),
    [
        ("200000 100000", 2),
        ("150000 100000", 1),
        ("50000 100000", 1),
        ("max 100000", 64),
        ("", 64),
        (None, 64),
    ],
)
def test_a_container_s_allowance_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, allowed: str | None, cores: int
) -> None:
    monkeypatch.setattr(os, "cpu_count", lambda: 64)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(64)))
    if allowed is not None:
        (tmp_path / "cpu.max").write_text(allowed)
    assert available_cores(tmp_path / "cpu.max") == cores


def test_so_does_what_a_process_may_run_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "cpu_count", lambda: 64)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {3, 5})
    assert available_cores(tmp_path / "cpu.max") == 2
