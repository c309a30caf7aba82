"""The rehearsal of docs/experiments.md's way to a GPU machine: nothing there but a Python with PyTorch."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from importlib.metadata import Distribution, distribution
from pathlib import Path

import pyarrow.parquet
import pytest
import yaml
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[2]
NO_NETWORK = ("unshare", "--map-root-user", "--net")
SHORT = {
    "agent.width": 32,
    "agent.batch_size": 32,
    "exploration.seed_steps": 1000,
    "evaluation.every": 1500,
    "evaluation.episodes": 1,
    "total_steps": 1500,
}
SOON = {"exploration.explore_steps": 250, "reward.width": 32}
# A machine that draws nothing may have no OpenGL: these are in the way of any that is there.
LIBRARIES = ("libEGL.so.1", "libOSMesa.so.8", "libGL.so.1", "libOpenGL.so.0", "libglfw.so.3")


def can_be_without_network() -> bool:
    known = shutil.which(NO_NETWORK[0])
    return bool(known) and subprocess.run([*NO_NETWORK, "true"], capture_output=True).returncode == 0


pytestmark = [
    pytest.mark.demo,
    pytest.mark.timeout(1800),
    pytest.mark.skipif(not can_be_without_network(), reason="this system lets nobody be without its network"),
]


def needs_of(name: str, found: dict[str, Distribution]) -> dict[str, Distribution]:
    """A distribution and all that it asks for here, by name."""
    if name not in found:
        found[name] = distribution(name)
        for line in found[name].requires or ():
            need = Requirement(line)
            if need.marker is None or need.marker.evaluate({"extra": ""}):
                needs_of(need.name, found)
    return found


def python_with_pytorch(folder: Path) -> Path:
    """A Python in an environment of its own that has PyTorch, what that needs, and nothing else."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True)
    site = next(folder.glob("lib/python*/site-packages"))
    for its in needs_of("torch", {}).values():
        for top in {file.parts[0] for file in its.files or () if not file.parts[0].startswith(".")}:
            if not (site / top).exists():
                (site / top).symlink_to(Path(str(its.locate_file(top))).resolve())
    return folder / "bin" / "python"


def copy_of_the_checkout(folder: Path) -> None:
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    files = subprocess.run(listed, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    for name in filter(None, files.split("\0")):
        if (ROOT / name).is_file():  # not deleted since the last commit
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, folder / name)


def bare_environment(folder: Path, python: Path) -> Mapping[str, str]:
    """No package manager, no OpenGL, no cache of packages, and a Python that is no environment's own."""
    broken, programs = folder / "broken", folder / "programs"
    for name in LIBRARIES:
        broken.mkdir(exist_ok=True)
        (broken / name).write_text("no library", encoding="utf-8")
    programs.mkdir()
    (programs / "apt-get").write_text("#!/bin/sh\nexit 1\n", encoding="utf-8")
    (programs / "apt-get").chmod(0o755)
    return {
        "PATH": f"{programs}:{os.environ['PATH']}",
        "HOME": str(folder / "home"),
        "LD_LIBRARY_PATH": str(broken),
        "PYTHON": str(python),
        "PYTORCH": "system",
        "WHEELS": str(folder / "wheels of there"),
    }


def shortened(experiment: Path, to: Path) -> Path:
    """The experiment with little networks and one seed, over as soon as it has asked once."""
    wanted = yaml.safe_load(experiment.read_text(encoding="utf-8"))
    for method in wanted["methods"]:
        if isinstance(method, dict):  # those that ask
            method["settings"] = {**method.get("settings", {}), **SOON}
    to.write_text(yaml.safe_dump({**wanted, "seeds": [1], "settings": SHORT}), encoding="utf-8")
    return to


def test_a_machine_with_nothing_but_pytorch_runs_the_paper_s_walker(tmp_path: Path) -> None:
    checkout, python = tmp_path / "checkout", python_with_pytorch(tmp_path / "theirs")
    copy_of_the_checkout(checkout)
    environment = bare_environment(tmp_path, python)
    fetch: list[str | Path] = [
        sys.executable,
        checkout / "scripts" / "fetch_wheels.py",
        environment["WHEELS"],
    ]
    subprocess.run(fetch, check=True)

    def there(*command: str | Path) -> str:
        done = subprocess.run([*NO_NETWORK, *command], cwd=checkout, env=environment, stdout=-1, text=True)
        assert done.returncode == 0, done.stdout
        return done.stdout

    there("make", "setup-experiments")
    used = there(".venv/bin/python", "-c", "import torch; print(torch.__path__[0])").strip()
    assert Path(used).parent == next((tmp_path / "theirs").glob("lib/python*/site-packages"))

    short = shortened(checkout / "benchmarks/experiments/walker-paper.yaml", tmp_path / "short.yaml")
    there(".venv/bin/pebble", "experiment", short, "--parallel", "2")
    rows = pyarrow.parquet.read_table(checkout / "data/experiments/walker-paper/results.parquet").to_pylist()
    assert {(row["method"], row["state"]) for row in rows} == {
        (method, "finished") for method in ("sac", "pebble-1400", "pebble-100")
    }
    assert {row["answers"] for row in rows if row["method"] == "pebble-100"} == {10}
