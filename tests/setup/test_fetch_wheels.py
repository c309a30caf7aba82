"""What is fetched for a machine that has PyTorch and no package index."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from scripts import fetch_wheels

FOUND = {
    "torch": "2.13.0",
    "triton": "3.7.1",
    "nvidia-cublas": "13.1",
    "cuda_bindings": "13.5.0",
    "torchless": "1.0",
    "mujoco": "3.16.0",
}


def test_pytorch_and_what_it_brings_stay_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[tuple[str, ...]] = []

    def pip(*arguments: str) -> str:
        calls.append(arguments)
        found = [{"metadata": {"name": name, "version": version}} for name, version in FOUND.items()]
        return json.dumps({"install": found})

    (tmp_path / "old-1.0-py3-none-any.whl").touch()
    monkeypatch.setattr(fetch_wheels, "pip", pip)
    monkeypatch.setattr("sys.argv", ["fetch_wheels.py", "--python", "3.12", str(tmp_path)])
    fetch_wheels.main()
    resolve, download = calls
    assert "--dry-run" in resolve
    assert download[-2:] == ("mujoco==3.16.0", "torchless==1.0")
    for call in calls:
        assert call[call.index("--python-version") + 1] == "3.12"
    assert list(tmp_path.iterdir()) == []  # two versions of one package would not do


def test_everything_that_installs_and_runs_an_experiment_is_asked_for() -> None:
    names = {name for line in fetch_wheels.requirements() for name in [line.split(">")[0].split("[")[0]]}
    assert names >= {"pip", "hatchling", "editables", "sqlalchemy", "torch", "dm-control", "pyarrow"}
    assert names.isdisjoint({"metaworld==3.0.0", "onnx", "pygame", "pytest"})


def test_a_pip_that_fails_ends_it() -> None:
    with pytest.raises(SystemExit) as ended:
        fetch_wheels.pip("download", "--no-such-option")
    assert ended.value.code
