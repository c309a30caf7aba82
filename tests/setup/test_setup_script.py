"""scripts/setup on machines of several kinds, with stand-ins for the programs that would change this one."""

from __future__ import annotations

import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

# A Python that knows `-c`, `-m venv` (which copies itself), `-m pip` and pip's wheel, and fails when told to.
PYTHON = """#!/usr/bin/env bash
case "$1 $2" in
    *".whl/pip install") echo "pip of the wheel ${*:3}" >>"$CALLS" ;;
    "-m venv") mkdir -p "${!#}/bin" && cp "$0" "${!#}/bin/python" && echo "${@:2:$#-2}" >>"$CALLS" ;;
    "-m pip")
        shift 2
        echo "pip $*" >>"$CALLS"
        if [ -e "$FAILING" ]; then exit 1; fi ;;
    "-c import ensurepip") [ ! -e "$NO_ENSUREPIP" ] ;;
    "-c import torch") [ -e "$HAS_TORCH" ] ;;
    "-c import sys; print"*) echo /their/site-packages ;;
    "-c import pathlib"*) echo "shows $3" >>"$CALLS" ;;
esac
"""
DPKG_QUERY = """#!/usr/bin/env bash
if grep -qx "${!#}" "$INSTALLED"; then echo installed; else exit 1; fi
"""
APT_GET = """#!/usr/bin/env bash
echo "apt-get $*" >>"$CALLS"
"""
SUDO = """#!/usr/bin/env bash
[ -e "$MAY_SUDO" ] && shift && "$@"
"""
PYTHONS = ["python3.11", "python3.12", "python3"]
PACKAGES = ["libegl1", "libgl1-mesa-dri", "libopengl0", "libosmesa6"]


@dataclass
class Machine:
    """A checkout on a machine of its own: what is installed there, who one is, what was called."""

    folder: Path
    user: int = 0

    def __post_init__(self) -> None:
        (self.checkout / "scripts").mkdir(parents=True)
        shutil.copy(ROOT / "scripts" / "setup", self.checkout / "scripts")
        shutil.copy(ROOT / "pyproject.toml", self.checkout)
        programs = {
            **dict.fromkeys(PYTHONS, PYTHON),
            "dpkg-query": DPKG_QUERY,
            "apt-get": APT_GET,
            "sudo": SUDO,
        }
        for name, text in {**programs, "id": f"#!/usr/bin/env bash\necho {self.user}\n"}.items():
            path = self.folder / "bin" / name
            path.parent.mkdir(exist_ok=True)
            path.write_text(text, encoding="utf-8")
            path.chmod(0o755)
        self.install(*PACKAGES, "chromium", "libatomic1")

    @property
    def checkout(self) -> Path:
        return self.folder / "checkout"

    def install(self, *packages: str) -> None:
        (self.folder / "INSTALLED").write_text("\n".join(packages), encoding="utf-8")

    def mark(self, name: str, *, on: bool = True) -> None:
        path = self.folder / name
        path.touch() if on else path.unlink()

    def setup(self, goal: str = "product", **environment: str) -> subprocess.CompletedProcess[str]:
        """Run the script as `make` does; `calls` then holds what it called."""
        self.calls_path.write_text("", encoding="utf-8")
        marks = ("CALLS", "INSTALLED", "FAILING", "NO_ENSUREPIP", "MAY_SUDO", "HAS_TORCH")
        environment |= {name: str(self.folder / name) for name in marks}
        environment["PATH"] = f"{self.folder / 'bin'}:{os.environ['PATH']}"
        return subprocess.run(
            [self.checkout / "scripts" / "setup", goal], env=environment, capture_output=True, text=True
        )

    @property
    def calls_path(self) -> Path:
        return self.folder / "CALLS"

    @property
    def calls(self) -> list[str]:
        return self.calls_path.read_text(encoding="utf-8").splitlines()

    @property
    def stood_up(self) -> bool:
        return (self.checkout / ".venv" / "installed-product").exists()


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


def test_a_fresh_checkout_gets_an_environment(machine: Machine) -> None:
    assert machine.setup().returncode == 0
    venv, upgrade, install = machine.calls
    assert venv == "venv"
    assert "--upgrade pip>=25.1" in upgrade
    assert install.endswith("--editable .[trainer,export,metaworld,classic,experiments]")
    assert sorted(path.name for path in (machine.checkout / ".venv").iterdir()) == [
        "bin",
        "installed-experiments",
        "installed-product",
    ]


def test_the_machine_s_own_pytorch_can_be_kept(machine: Machine) -> None:
    refused = machine.setup(PYTORCH="system")
    assert refused.returncode != 0
    assert f"no PyTorch in {' '.join(PYTHONS)}; name a Python that has it by PYTHON=" in refused.stderr
    machine.mark("HAS_TORCH")
    assert machine.setup(PYTORCH="system").returncode == 0
    assert machine.calls[:2] == ["venv", "shows /their/site-packages"]
    assert machine.setup(PYTORCH="system").returncode == 0
    assert machine.calls == []
    machine.setup()
    assert machine.calls[0] == "venv"  # another way of having it is another environment
    assert not any(call.startswith("shows") for call in machine.calls)
    machine.setup(PYTORCH="system")
    assert machine.calls[:2] == ["venv", "shows /their/site-packages"]
    assert "PYTORCH=cuda: unknown" in machine.setup(PYTORCH="cuda").stderr


def test_of_several_pythons_the_one_with_pytorch_is_taken(machine: Machine) -> None:
    machine.mark("HAS_TORCH")
    without = PYTHON.replace('[ -e "$HAS_TORCH" ]', "exit 1")
    (machine.folder / "bin" / "python3.11").write_text(without, encoding="utf-8")
    assert machine.setup(PYTORCH="system").returncode == 0
    assert (machine.checkout / ".venv" / "bin" / "python").read_text(encoding="utf-8") == PYTHON


def test_experiments_with_scripted_teachers_need_nothing_that_draws(machine: Machine) -> None:
    machine.install()
    assert machine.setup("experiments").returncode == 0
    assert not any(call.startswith("apt-get") for call in machine.calls)
    assert machine.calls[-1].endswith("--editable .[trainer,experiments]")
    assert machine.setup("experiments").returncode == 0
    assert machine.calls == []
    assert not machine.stood_up


def test_wheels_do_without_a_network_and_without_python_s_own_pip(machine: Machine) -> None:
    machine.install()
    machine.mark("NO_ENSUREPIP")
    wheels = machine.folder / "some wheels"
    wheels.mkdir()
    refused = machine.setup("experiments", WHEELS=str(wheels))
    assert refused.returncode != 0
    assert f"WHEELS={wheels}: no pip there; `make wheels` fills such a folder" in refused.stderr
    (wheels / "pip-26.0-py3-none-any.whl").touch()
    assert machine.setup("experiments", WHEELS=str(wheels)).returncode == 0
    venv, own_pip, upgrade, install = machine.calls
    assert venv == "venv --without-pip"
    for call in (own_pip, upgrade, install):
        assert f"--no-index --find-links {wheels}" in call


def test_the_second_time_nothing_is_done(machine: Machine) -> None:
    for goal in ("product", "tests"):
        machine.setup(goal)
        again = machine.setup(goal)
        assert (again.returncode, again.stdout, machine.calls) == (0, "", [])


def test_tests_need_the_development_packages_too(machine: Machine) -> None:
    machine.setup("product")
    machine.setup("tests")
    assert "--group dev" in machine.calls[-1]
    machine.setup("product")
    assert machine.calls == []


def test_changed_requirements_are_installed(machine: Machine) -> None:
    machine.setup()
    with (machine.checkout / "pyproject.toml").open("a", encoding="utf-8") as file:
        file.write("\n")
    machine.setup()
    assert [call.split()[0] for call in machine.calls] == ["pip", "pip"]


def test_what_a_broken_off_try_left_is_made_anew(machine: Machine) -> None:
    machine.mark("FAILING")
    assert machine.setup().returncode != 0
    assert not machine.stood_up
    (machine.checkout / ".venv" / "downloads").mkdir(exist_ok=True)
    (machine.checkout / ".venv" / "half-unpacked").touch()
    machine.mark("FAILING", on=False)
    assert machine.setup().returncode == 0
    assert machine.calls[0] == "venv"
    assert machine.stood_up
    assert not (machine.checkout / ".venv" / "half-unpacked").exists()


def test_an_environment_without_pip_is_made_anew(machine: Machine) -> None:
    broken = machine.checkout / ".venv" / "bin" / "python"
    broken.parent.mkdir(parents=True)
    broken.write_text("#!/bin/sh\nexit 1\n", encoding="utf-8")
    broken.chmod(0o755)
    assert machine.setup().returncode == 0
    assert machine.stood_up


def test_root_gets_missing_packages_installed(machine: Machine) -> None:
    machine.install("libegl1", "libosmesa6")
    assert machine.setup("tests").returncode == 0
    update, install = machine.calls[:2]
    assert update == "apt-get update -qq"
    assert install.split()[-4:] == ["libgl1-mesa-dri", "libopengl0", "chromium", "libatomic1"]


def test_python_without_venv_gets_it_the_same_way(machine: Machine) -> None:
    machine.mark("NO_ENSUREPIP")
    machine.setup()
    assert machine.calls[1].endswith(" python3-venv")


@pytest.mark.parametrize("may_sudo", [True, False])
def test_others_need_sudo_or_are_told_what_to_run(tmp_path: Path, may_sudo: bool) -> None:
    machine = Machine(tmp_path, user=1000)
    machine.install(*PACKAGES[1:])
    if may_sudo:
        machine.mark("MAY_SUDO")
    result = machine.setup()
    assert (result.returncode == 0) is may_sudo
    if may_sudo:
        assert machine.calls[1].endswith(" libegl1")
    else:
        assert "sudo apt-get install -y libegl1\n" in result.stderr
        assert machine.calls == []


def test_an_unknown_goal_is_named(machine: Machine) -> None:
    result = machine.setup("moon")
    assert result.returncode == 1
    assert "moon: unknown; one of product, tests, experiments" in result.stderr
