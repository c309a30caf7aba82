"""Every package that experiments need beside PyTorch, as wheels for a machine that reaches no package index.

python scripts/fetch_wheels.py --python 3.12 FOLDER
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
EXTRAS = ("trainer", "experiments")
TO_INSTALL = ("pip>=25.1", "editables")
"""What installs the project there, beside its build system: hatchling makes an editable wheel with editables."""

OF_PYTORCH = ("torch", "triton", "nvidia", "cuda")
"""First words of packages that come with PyTorch for a GPU, which the other machine has."""

Report = dict[str, Any]
"""What `pip install --report` writes."""


def main() -> None:
    """Fill the folder anew."""
    arguments = parsed(sys.argv[1:])
    folder: Path = arguments.folder
    of_there = ["--only-binary=:all:", "--python-version", arguments.python]
    pinned = beside_pytorch(resolved(of_there))
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.whl"):
        old.unlink()
    pip("download", "-qq", "--no-deps", *of_there, "--dest", str(folder), *pinned)
    size = sum(path.stat().st_size for path in folder.glob("*.whl"))
    print(f"{len(pinned)} wheels for Python {arguments.python}, {size / 1e6:.0f} MB, in {folder}")


def parsed(line: Sequence[str]) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    here = f"{sys.version_info.major}.{sys.version_info.minor}"
    parser.add_argument("--python", default=here, help="Python of the other machine (this one's)")
    parser.add_argument("folder", type=Path)
    return parser.parse_args(line)


def requirements() -> list[str]:
    """What the project asks for where only experiments run, and what installs it."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    extras = project["project"]["optional-dependencies"]
    asked = [*project["project"]["dependencies"], *(need for extra in EXTRAS for need in extras[extra])]
    return [*project["build-system"]["requires"], *TO_INSTALL, *asked]


def resolved(of_there: Sequence[str]) -> Report:
    """What pip would install there, from the index's metadata alone."""
    target = ["--target", "unused", "--dry-run", "--ignore-installed"]  # nothing of this machine counts
    report = pip("install", "-qq", *target, *of_there, "--report", "-", *requirements())
    return dict(json.loads(report))


def beside_pytorch(report: Report) -> list[str]:
    """`name==version` of every package that PyTorch does not bring."""
    found = [(item["metadata"]["name"], item["metadata"]["version"]) for item in report["install"]]
    return sorted(f"{name}=={version}" for name, version in found if not is_pytorch_s(name))


def is_pytorch_s(name: str) -> bool:
    return name.replace("_", "-").split("-")[0].lower() in OF_PYTORCH


def pip(*arguments: str) -> str:
    """Pip's output; its own complaint ends the program."""
    command: Iterable[str] = (sys.executable, "-m", "pip", "--disable-pip-version-check", *arguments)
    done = subprocess.run(list(command), stdout=subprocess.PIPE, text=True)
    if done.returncode:
        raise SystemExit(done.returncode)
    return done.stdout


if __name__ == "__main__":
    main()
