"""What every test may ask for: a data folder of its own with an open record."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from labels_db.data_folder import DataFolder
from labels_db.database import Database
from labels_db.storage import ArtifactStore

# One thread each: tests run side by side, and exact repetition is promised for one thread only.
for variable in ("OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

# The same examples everywhere, so that a change never fails for what another one did.
settings.register_profile("pebble", deadline=None, derandomize=True, database=None)
settings.load_profile("pebble")


@pytest.fixture(scope="session")
def migrated_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data folder with an empty record: copied, since migrating takes a while."""
    data = DataFolder(tmp_path_factory.mktemp("migrated"))
    data.open_database().close()
    return data.path


@pytest.fixture
def data(migrated_folder: Path, tmp_path: Path) -> DataFolder:
    """A data folder of the test's own."""
    return DataFolder(shutil.copytree(migrated_folder, tmp_path / "data"))


@pytest.fixture
def database(data: DataFolder) -> Iterator[Database]:
    """The open record of the test's data folder."""
    opened = Database(data.database_path)
    yield opened
    opened.close()


@pytest.fixture
def store(data: DataFolder) -> ArtifactStore:
    """The artifact store of the test's data folder."""
    return data.open_store()
