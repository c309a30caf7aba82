"""Several processes on one record: nothing owned twice, no number missed, nothing acknowledged lost."""

from __future__ import annotations

import multiprocessing
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from pathlib import Path

import pytest
from sqlalchemy import select

from labels_db.answers import answers_since
from labels_db.data_folder import DataFolder
from labels_db.database import Database
from labels_db.models import Answer
from tests.labels_db import given, workers

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def processes() -> Iterator[ProcessPoolExecutor]:
    """Four fresh processes, which share nothing with this one."""
    with ProcessPoolExecutor(4, mp_context=multiprocessing.get_context("spawn")) as pool:
        yield pool


def test_two_supervisors_never_own_one_run(database: Database, processes: ProcessPoolExecutor) -> None:
    names = {f"run-{number}" for number in range(20)}
    with database.write() as session:
        for name in names:
            given.a_run(session, name)
    futures = [processes.submit(workers.claim_until_none, database.path) for _ in range(2)]
    one, two = (future.result() for future in futures)
    assert sorted(one + two) == sorted(names)


def test_numbers_have_no_gap_and_a_cursor_misses_none(
    database: Database, processes: ProcessPoolExecutor
) -> None:
    with database.write() as session:
        given.queries(session, given.a_claim(session), 60)
    futures = [processes.submit(workers.answer_until_none, database.path, f"p{n}") for n in range(4)]
    read = _poll(database, futures)
    answered = [answer_id for future in futures for answer_id in future.result()]
    assert [sequence for sequence, _ in read] == list(range(1, 61))
    assert sorted(answer_id for _, answer_id in read) == sorted(answered)


def _poll(database: Database, futures: list[Future[list[str]]]) -> list[tuple[int, str]]:
    """Read as a trainer does, from the cursor on, until the writers are done and all is read."""
    read: list[tuple[int, str]] = []
    while True:
        done = all(future.done() for future in futures)
        with database.read() as session:
            new = answers_since(session, "mill", read[-1][0] if read else 0)
            read += [(answer.sequence, answer.answer_id) for answer in new]
        if done:
            return read


def test_a_killed_process_loses_no_acknowledged_answer(database: Database) -> None:
    with database.write() as session:
        given.queries(session, given.a_claim(session), 150)
    writing = [sys.executable, "-m", "tests.labels_db.workers", str(database.path)]
    with subprocess.Popen(writing, cwd=ROOT, stdout=subprocess.PIPE, text=True) as writer:
        assert writer.stdout is not None
        heard = [next(writer.stdout).strip() for _ in range(25)]
        writer.kill()
        heard += [line.strip() for line in writer.stdout if line.endswith("\n")]
    with database.write() as session:
        kept = session.scalars(select(Answer.answer_id).order_by(Answer.sequence)).all()
        sequences = session.scalars(select(Answer.sequence).order_by(Answer.sequence)).all()
        assert session.connection().exec_driver_sql("PRAGMA integrity_check").scalar() == "ok"
    assert list(kept[: len(heard)]) == heard
    assert len(kept) < 150
    assert list(sequences) == list(range(1, len(kept) + 1))


def test_processes_that_start_together_migrate_once(tmp_path: Path, processes: ProcessPoolExecutor) -> None:
    for number in range(3):
        folder = tmp_path / str(number)
        futures = [processes.submit(workers.open_record, folder) for _ in range(4)]
        assert len({future.result() for future in futures}) == 1
        assert DataFolder(folder).database_path.exists()
