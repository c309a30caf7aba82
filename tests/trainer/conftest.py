"""Small real runs: a cart pole, tiny networks, a real database and a real store."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from labels_db.claims import Claim, claim
from labels_db.data_folder import DataFolder
from labels_db.database import Database
from labels_db.models import RunState, utc_now
from labels_db.overrides import with_settings
from labels_db.presets import preset_named
from labels_db.run_config import RunConfig
from labels_db.runs import get_run, request_run
from labels_db.storage import ArtifactStore
from trainer.attempt import Attempt

RUN = "tiny"

SMALL = {
    "environment.action_repeat": 8,  # 125 steps an episode
    "agent.width": 16,
    "agent.batch_size": 16,
    "reward.width": 16,
    "reward.max_epochs": 5,
    "exploration.seed_steps": 130,
    "exploration.explore_steps": 170,
    "feedback.budget": 12,
    "feedback.queries_per_session": 4,
    "feedback.steps_between": 150,
    "evaluation.every": 400,
    "evaluation.video": "none",
    "total_steps": 900,
    "clips.width": 64,
    "clips.height": 64,
}


def small_config(preset: str = "cartpole-windmill-clockwise", **changes: Any) -> RunConfig:
    """The preset made small; `a__b=1` sets `a.b`."""
    small = {**SMALL, "feedback.teacher.kind": "oracle"}
    asked = {name.replace("__", "."): value for name, value in changes.items()}
    config = with_settings(preset_named(preset).config(), {path: str(v) for path, v in small.items()})
    return with_settings(config, {path: str(value) for path, value in asked.items()})


@dataclass
class Lab:
    """A data folder in which runs are asked for and lived through."""

    data: DataFolder
    database: Database
    store: ArtifactStore

    def request(self, config: RunConfig, run_id: str = RUN) -> str:
        with self.database.write() as session:
            return request_run(session, config, title="Tiny", goal="Spin.", run_id=run_id).id

    def claim(self, run_id: str = RUN) -> Claim:
        with self.database.write() as session:
            return claim(session, get_run(session, run_id), "test", now=utc_now())

    def live(self, run_id: str = RUN) -> RunState | None:
        return Attempt(self.data, self.claim(run_id)).live()


def new_lab(path: Path) -> Lab:
    data = DataFolder(path)
    return Lab(data, data.open_database(), data.open_store())


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[Lab]:
    made = new_lab(tmp_path / "data")
    yield made
    made.database.close()


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Lab:
    lab = new_lab(tmp_path_factory.mktemp("undisturbed"))
    lab.request(small_config())
    assert lab.live() is RunState.FINISHED
    return lab
