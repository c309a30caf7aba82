"""Where results come from: the experiment's file, every setting, and the versions that lived through it."""

from __future__ import annotations

import json
import platform
import subprocess
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import torch

from labels_db.data_folder import DataFolder
from labels_db.experiments import Experiment
from trainer.experiments.results import results_folder, written_whole
from trainer.precision import fast_in_bfloat16

PACKAGES = (
    "pebble-teach",
    "torch",
    "numpy",
    "mujoco",
    "dm-control",
    "gymnasium",
    "metaworld",
    "stable-baselines3",
    "pillow",
)
CHECKOUT = Path(__file__).parents[2]


def write_provenance(experiment: Experiment, data: DataFolder) -> None:
    """What is run, and by which versions: at the time of running, not of drawing."""
    folder = results_folder(experiment, data)
    written = {
        "experiment": experiment.model_dump(mode="json"),
        "configurations": configurations(experiment),
        "versions": _with_todays(folder / "versions.json"),
    }
    for name, value in written.items():
        _write(folder / f"{name}.json", value)


def configurations(experiment: Experiment) -> dict[str, Any]:
    """Every setting of each task and method, by the first seed's run: presets change as time goes by."""
    first = experiment.seeds[0]
    return {
        one.run_id: one.config.model_dump(mode="json") for one in experiment.planned() if one.seed == first
    }


def join_versions(experiment: Experiment, data: DataFolder, results: Path) -> None:
    """Let the versions of other results have had a part in these too, in the order of their moments."""
    path = results_folder(experiment, data) / "versions.json"
    had = {json.dumps(one): one for one in [*_known(path), *_known(results / "versions.json")]}
    _write(path, sorted(had.values(), key=lambda one: one["since"]))


def _write(path: Path, value: Any) -> None:
    written_whole(path, (json.dumps(value, indent=1) + "\n").encode())


def _known(path: Path) -> list[dict[str, str]]:
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else []


def _with_todays(path: Path) -> list[dict[str, str]]:
    """All versions that had a part in it, each with the moment since which it has."""
    known = _known(path)
    today = versions()
    if known and {**known[-1], "since": ""} == {**today, "since": ""}:
        return known
    return [*known, {"since": datetime.now(UTC).isoformat(timespec="seconds"), **today}]


def versions() -> dict[str, str]:
    """Of Python, this program and the libraries that results depend on; in a checkout, of the code itself.

    And whether `precision: auto` means bfloat16 on this processor.
    """
    fast = fast_in_bfloat16(torch.device("cpu"))
    machine = platform.machine()
    found = {"python": platform.python_version(), "machine": machine, "bfloat16": "fast" if fast else "slow"}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return {**found, "commit": commit} if (commit := _commit()) else found


def _commit() -> str:
    """The commit that the code is at, marked where files differ from it; nothing outside a checkout.

    What benchmarks have written is no code.
    """
    if not (CHECKOUT / ".git").exists():
        return ""
    try:
        commit = _git("describe", "--always", "--exclude=*")
        changed = _git("diff", "--name-only", "HEAD", "--", ".", ":!benchmarks/results")
    except (OSError, subprocess.CalledProcessError):
        return ""
    return f"{commit}-dirty" if changed else commit


def _git(*arguments: str) -> str:
    command = ["git", "-C", str(CHECKOUT), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
