"""`pebble doctor`: tries for real what a run needs, and says what to do where it fails."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from importlib.metadata import version

import typer

from labels_db.data_folder import DataFolder

PACKAGES = ("torch", "mujoco", "dm-control", "gymnasium", "fastapi", "sqlalchemy")


def examine(data: DataFolder) -> int:
    """Run every check; 0 when all are well."""
    checks: tuple[tuple[str, Callable[[DataFolder], str]], ...] = (
        ("Python", _python),
        ("Packages", _packages),
        ("Rendering", _rendering),
        ("Database", _database),
        ("Artifacts", _artifacts),
        ("Disk", _disk),
        ("Arithmetic", _arithmetic),
        ("Supervisor", _supervisor),
    )
    return max([_report(name, check, data) for name, check in checks])


def _report(name: str, check: Callable[[DataFolder], str], data: DataFolder) -> int:
    try:
        typer.echo(f"  ✓ {name:<11} {check(data)}")
    except Exception as error:  # whatever fails here is the finding
        typer.echo(f"  ✗ {name:<11} {error}")
        return 1
    return 0


def _python(_data: DataFolder) -> str:
    if not (3, 11) <= sys.version_info[:2] < (3, 13):
        raise RuntimeError(f"{sys.version.split()[0]}: needs 3.11 or 3.12 (dm_control has no wheels beyond)")
    return sys.version.split()[0]


def _packages(_data: DataFolder) -> str:
    return ", ".join(f"{package} {version(package)}" for package in PACKAGES)


def _rendering(_data: DataFolder) -> str:
    from trainer.rendering import check_rendering

    return f"drew a frame with {check_rendering()}"


def _database(data: DataFolder) -> str:
    import pysqlite3.dbapi2 as sqlite

    with data.open_database() as database, database.write() as session:
        session.connection()
    return f"{data.database_path} opens and takes writes (SQLite {sqlite.sqlite_version})"


def _artifacts(data: DataFolder) -> str:
    store = data.open_store()
    store.read("doctor/probe", store.write("doctor/probe", b"pebble"))
    store.delete("doctor/probe")
    return "an artifact can be written, read back and deleted"


def _disk(data: DataFolder) -> str:
    from labels_db.estimate import estimate_bytes
    from labels_db.presets import presets

    free = shutil.disk_usage(data.path).free
    needs = {p.name: estimate_bytes(p.config()).total for p in presets().values()}
    largest = max(needs, key=lambda name: needs[name])
    if free < needs[largest]:
        raise OSError(
            f"{data.path}: {free / 1e9:.1f} GB free, {largest} needs {needs[largest] / 1e9:.1f}; use --data"
        )
    listed = ", ".join(f"{name} {size / 1e6:.0f} MB" for name, size in needs.items())
    return f"{free / 1e9:.0f} GB free; a run needs about: {listed}"


def _arithmetic(_data: DataFolder) -> str:
    import torch

    where = torch.cuda.get_device_name() if torch.cuda.is_available() else "the CPU"
    return f"PyTorch computes on {where}"


def _supervisor(data: DataFolder) -> str:
    from cli.errors import UsageError
    from cli.serving import require_supervisor

    try:
        require_supervisor(data)
    except UsageError:
        return "none is running; `pebble up` starts one"
    return "looks after this folder"
