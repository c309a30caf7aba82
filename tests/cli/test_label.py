"""`pebble label`: a scripted teacher with faults answers through the API of a real server."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from safetensors.numpy import save as save_arrays
from sqlalchemy import select

from labels_db.data_folder import DataFolder
from labels_db.database import Database
from labels_db.models import Answer, Choice, FeedbackSession, Segment
from labels_db.storage import ArtifactStore
from tests.cli.test_commands import pebble
from tests.labelling_rig import LabelRun
from tests.serving import served


@pytest.fixture
def address(data: DataFolder) -> Iterator[str]:
    """A server on the data folder."""
    with served(data) as url:
        yield f"http://{urlsplit(url).netloc}"


def earn(database: Database, store: ArtifactStore) -> None:
    """Segments of the last episodes earned 100; first segments earn at their end, second ones at their start."""
    with database.write() as session:
        session.get_one(FeedbackSession, 1).segment_return = 100.0
        for segment in session.scalars(select(Segment)):
            rewards = np.zeros(segment.length, np.float32)
            rewards[0 if segment.episode % 2 else -1] = segment.true_return
            segment.checksum = store.write(segment.artifact_key, save_arrays({"rewards": rewards}))


@pytest.mark.parametrize(
    ("arguments", "choice"),
    [
        (["--teacher", "oracle"], Choice.SECOND),  # a later segment of the rig earns more
        (["--teacher", "mistake", "--set", "mistake=1"], Choice.FIRST),
        (["--teacher", "stochastic", "--set", "rationality=1000", "--set", "mistake=1"], Choice.FIRST),
        (["--teacher", "skip"], Choice.SKIP),  # the rig's returns are small beside what segments earned
        (["--teacher", "equal"], Choice.EQUAL),
        (["--teacher", "equal", "--set", "equal=1e-6"], Choice.SECOND),
        (["--teacher", "myopic"], Choice.FIRST),  # which earns all of it at its end, the other at its start
        (["--teacher", "myopic", "--set", "discount=1"], Choice.SECOND),
    ],
)
def test_it_answers_with_its_faults_until_it_has_given_enough(
    address: str, data: DataFolder, arguments: list[str], choice: Choice
) -> None:
    database = data.open_database()
    LabelRun(database, data.open_store()).begin().post(3)
    earn(database, data.open_store())
    done = pebble("label", "mill", "--url", address, "--answers", "2", *arguments, data=data.path)
    assert done.returncode == 0, done.stderr
    assert "2 answers given." in done.stderr
    with database.read() as session:
        assert [answer.choice for answer in session.scalars(select(Answer))] == [choice] * 2
    database.close()


@pytest.mark.parametrize(
    ("setting", "complaint"),
    [
        ("mistake", "--set mistake: must be NAME=VALUE, as in --set equal=0.1"),
        ("kind=human", "--set kind=human: choose it by --teacher"),
        ("mistake=2", "--set mistake: must be at most 1"),
        ("mistakes=0.1", "--set mistakes: unknown setting 'mistakes'; did you mean mistake?"),
    ],
)
def test_a_wrong_fault_is_named(tmp_path: Path, setting: str, complaint: str) -> None:
    done = pebble("label", "nobody", "--set", setting, data=tmp_path)
    assert done.returncode == 2
    assert complaint in done.stderr
