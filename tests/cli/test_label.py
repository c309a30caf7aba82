"""`pebble label`: a scripted teacher with faults answers through the API of a real server."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from sqlalchemy import select

from labels_db.data_folder import DataFolder
from labels_db.models import Answer, Choice
from tests.cli.test_commands import pebble
from tests.labelling_rig import LabelRun
from tests.serving import served


@pytest.fixture
def address(data: DataFolder) -> Iterator[str]:
    """A server on the data folder."""
    with served(data) as url:
        yield f"http://{urlsplit(url).netloc}"


@pytest.mark.parametrize(
    ("arguments", "choice"),
    [
        (["--teacher", "oracle"], Choice.SECOND),  # a later segment of the rig earns more
        (["--teacher", "mistake", "--set", "mistake=1"], Choice.FIRST),
        (["--teacher", "stochastic", "--set", "rationality=1000", "--set", "mistake=1"], Choice.FIRST),
    ],
)
def test_it_answers_with_its_faults_until_it_has_given_enough(
    address: str, data: DataFolder, arguments: list[str], choice: Choice
) -> None:
    database = data.open_database()
    LabelRun(database, data.open_store()).begin().post(3)
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
