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


Versions = list[dict[str, str]]
"""All that had a part in results, each with the moment since which it has."""


def write_plan(experiment: Experiment, data: DataFolder) -> None:
    """What is asked: the file, and every setting that follows from it."""
    folder = results_folder(experiment, data)
    _write(folder / "experiment.json", experiment.model_dump(mode="json"))
    _write(folder / "configurations.json", configurations(experiment))


def write_versions(experiment: Experiment, data: DataFolder) -> None:
    """Today's have a part in it: called when something is run, not when it is drawn."""
    today = {"since": datetime.now(UTC).isoformat(timespec="seconds"), **versions()}
    known = kept_versions(results_folder(experiment, data))
    if not any({**one, "since": ""} == {**today, "since": ""} for one in known):
        join_versions(experiment, data, [today])


def join_versions(experiment: Experiment, data: DataFolder, others: Versions) -> None:
    """They had a part in it too."""
    folder = results_folder(experiment, data)
    had = {json.dumps(one): one for one in [*kept_versions(folder), *others]}
    _write(folder / "versions.json", sorted(had.values(), key=lambda one: one["since"]))


def kept_versions(results: Path) -> Versions:
    """Those beside some results; none where nothing has been run yet. ValueError for another kind of file."""
    path = results / "versions.json"
    known = json.loads(path.read_text(encoding="utf-8")) if path.exists() else []
    if not (isinstance(known, list) and all("since" in one for one in known)):
        raise ValueError(f"{path}: is no list of versions, each with its `since`")
    return known


def _write(path: Path, value: Any) -> None:
    written_whole(path, (json.dumps(value, indent=1) + "\n").encode())


def configurations(experiment: Experiment) -> dict[str, Any]:
    """Every setting of each task and method, by the first seed's run: presets change as time goes by."""
    first = experiment.seeds[0]
    return {
        one.run_id: one.config.model_dump(mode="json") for one in experiment.planned() if one.seed == first
    }


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
