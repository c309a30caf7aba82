"""The application over a data folder of its own, and a client that holds its token."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient

from labels_db.data_folder import DataFolder
from labels_db.database import Database
from labels_db.models import Base
from labels_db.storage import ArtifactStore
from server.app import create_app
from server.services import Services
from server.token import access_token
from tests.labelling_rig import LabelRun
from tests.server.labelling_client import client

BASE = "http://127.0.0.1:8000"


@dataclass(frozen=True)
class Site:
    """A served installation: anonymous and trusted clients on it, and its record."""

    data: DataFolder
    app: FastAPI
    anonymous: TestClient
    client: TestClient

    @property
    def services(self) -> Services:
        found: Services = self.app.state.services
        return found

    @property
    def database(self) -> Database:
        return self.services.database

    @property
    def token(self) -> str:
        return access_token(self.data)


@pytest.fixture(scope="session")
def installation(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[DataFolder, FastAPI]]:
    """One application for all tests: its first request costs a tenth of a second."""
    data = DataFolder(Path(tmp_path_factory.mktemp("site")))
    app = create_app(data, hosts=["pebble.example"])
    with TestClient(app, base_url=BASE):
        yield data, app


@pytest.fixture
def site(installation: tuple[DataFolder, FastAPI]) -> Iterator[Site]:
    """That application with an empty record."""
    data, app = installation
    bearer = {"Authorization": f"Bearer {access_token(data)}"}
    anonymous = TestClient(app, base_url=BASE, follow_redirects=False)
    client = TestClient(
        app, base_url=BASE, headers=bearer, follow_redirects=False, raise_server_exceptions=False
    )
    made = Site(data, app, anonymous, client)
    yield made
    with made.database.write() as session:
        for table in reversed(Base.metadata.sorted_tables):
            session.execute(table.delete())


@pytest.fixture
def run(database: Database, store: ArtifactStore) -> LabelRun:
    """A run that asks people, without a trainer behind it."""
    return LabelRun(database, store).begin()


@pytest.fixture
def ann(data: DataFolder) -> Iterator[TestClient]:
    with client(data, "Ann") as made:
        yield made


@pytest.fixture
def bob(data: DataFolder) -> Iterator[TestClient]:
    with client(data, "Bob") as made:
        yield made
