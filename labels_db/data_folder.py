"""Where one installation keeps everything: database, artifacts, logs, token."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from labels_db import catalogue
from labels_db.database import Database
from labels_db.migrate import open_database
from labels_db.storage import ArtifactStore


@dataclass(frozen=True)
class DataFolder:
    """The folder given by `--data` or `PEBBLE_DATA`, `./data` by default."""

    path: Path
    artifacts_url: str | None = None

    def __post_init__(self) -> None:
        """Whoever works in the folder knows the environments that were added to it."""
        catalogue.include(self.catalogue_path)

    @property
    def database_path(self) -> Path:
        """The record."""
        return self.path / "pebble.db"

    @property
    def catalogue_path(self) -> Path:
        """Environments added to this installation."""
        return self.path / "catalogue.json"

    @property
    def token_path(self) -> Path:
        return self.path / "token"

    @property
    def heartbeat_path(self) -> Path:
        """Touched by every supervisor each time it looks."""
        return self.path / "supervisor.heartbeat"

    def log_path(self, run_id: str) -> Path:
        return self.path / "logs" / f"{run_id}.log"

    def events_path(self, run_id: str) -> Path:
        """TensorBoard event files of a run."""
        return self.path / "tensorboard" / run_id

    def open_database(self) -> Database:
        self.path.mkdir(parents=True, exist_ok=True)
        return open_database(self.database_path)

    def open_store(self) -> ArtifactStore:
        return ArtifactStore(self.artifacts_url or str((self.path / "artifacts").resolve()))
