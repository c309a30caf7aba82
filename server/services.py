"""What request handlers work with, made once per process and found through FastAPI's dependencies."""

from __future__ import annotations

import random
from dataclasses import dataclass, field
from typing import Annotated

from fastapi import Depends, Request

from labels_db.data_folder import DataFolder
from labels_db.database import Database
from labels_db.storage import ArtifactStore


@dataclass(frozen=True)
class Services:
    """The open record and store of one installation, and the source of random sides."""

    data: DataFolder
    database: Database
    store: ArtifactStore
    rng: random.Random = field(default_factory=random.SystemRandom)


def services(request: Request) -> Services:
    found: Services = request.app.state.services
    return found


ServicesDep = Annotated[Services, Depends(services)]
