"""How the database is opened, and what reading and writing promise."""

from __future__ import annotations

import threading
import time
from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import pysqlite3.dbapi2 as sqlite
import pytest
from sqlalchemy.exc import IntegrityError, OperationalError, StatementError

from labels_db.data_folder import DataFolder
from labels_db.database import BUSY_TIMEOUT_MS, Database, wal_is_safe
from labels_db.models import GoalCard, Run
from tests.labels_db import given
from tests.labels_db.given import NOW, SECOND


@pytest.mark.parametrize(
    ("version", "safe"),
    [
        ((3, 40, 1), False),
        ((3, 44, 5), False),
        ((3, 44, 6), True),
        ((3, 45, 0), False),
        ((3, 50, 6), False),
        ((3, 50, 7), True),
        ((3, 51, 2), False),
        ((3, 51, 3), True),
        ((3, 53, 4), True),
        ((4, 0, 0), True),
    ],
)
def test_wal_is_used_where_it_cannot_corrupt(version: tuple[int, int, int], safe: bool) -> None:
    assert wal_is_safe(version) is safe


def _pragma(database: Database, name: str) -> Any:
    with database.read() as session:
        return session.connection().exec_driver_sql(f"PRAGMA {name}").scalar()


def test_every_connection_is_opened_for_durability(database: Database) -> None:
    assert _pragma(database, "journal_mode") == "wal"
    assert _pragma(database, "synchronous") == 2
    assert _pragma(database, "foreign_keys") == 1
    assert _pragma(database, "busy_timeout") == BUSY_TIMEOUT_MS


def test_an_older_sqlite_keeps_a_rollback_journal(data: DataFolder, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sqlite, "sqlite_version_info", (3, 40, 1))
    older = Database(data.database_path)
    assert _pragma(older, "journal_mode") == "truncate"
    older.close()


def test_a_database_opened_by_with_gives_its_connections_back(data: DataFolder) -> None:
    with data.open_database() as database:
        _pragma(database, "journal_mode")
        used = database.engine.pool
    assert database.engine.pool is not used  # a closed engine begins anew, without connections


def test_opening_waits_while_another_process_creates_the_database(tmp_path: Path) -> None:
    path = tmp_path / "new.db"
    creator = sqlite.connect(str(path), isolation_level=None, check_same_thread=False)
    creator.execute("CREATE TABLE made (by)")
    creator.execute("BEGIN IMMEDIATE")
    done = threading.Timer(0.3, lambda: creator.execute("COMMIT"))
    done.start()
    database = Database(path)
    with database.read() as session:
        assert session.connection().exec_driver_sql("SELECT count(*) FROM made").scalar() == 0
    assert _pragma(database, "journal_mode") == "wal"
    database.close()
    done.join()
    creator.close()


def test_a_row_needs_what_it_points_at(database: Database) -> None:
    card = GoalCard(run_id="nowhere", version=1, text="", created_at=NOW)
    with pytest.raises(IntegrityError, match="FOREIGN KEY"), database.write() as session:
        session.add(card)


def test_a_write_that_fails_leaves_nothing(database: Database) -> None:
    with pytest.raises(ZeroDivisionError):
        _write_and_fail(database)
    with database.read() as session:
        assert session.get(Run, "mill") is None


def _write_and_fail(database: Database) -> None:
    with database.write() as session:
        given.a_run(session)
        raise ZeroDivisionError


def test_a_read_refuses_to_write(database: Database) -> None:
    with database.read() as session, pytest.raises(OperationalError, match="readonly"):
        given.a_run(session)


def test_a_connection_that_has_read_can_write_again(database: Database) -> None:
    for name in ("one", "two", "three"):
        with database.read() as session:
            assert session.get(Run, name) is None
        with database.write() as session:
            given.a_run(session, name)
        with database.read() as session:
            assert session.get(Run, name) is not None


def test_a_read_sees_one_snapshot(database: Database) -> None:
    with database.read() as reader:
        assert reader.get(Run, "mill") is None
        with database.write() as writer:
            given.a_run(writer)
        assert reader.get(Run, "mill") is None


def test_what_was_read_stays_usable(database: Database) -> None:
    with database.write() as session:
        given.a_run(session)
    with database.read() as session:
        run = session.get_one(Run, "mill")
    assert run.title == "Windmill"


def test_writers_in_threads_queue_up(database: Database) -> None:
    with database.write() as session:
        given.a_run(session)

    def count_up() -> None:
        for _ in range(25):
            with database.write() as session:
                run = session.get_one(Run, "mill")
                run.step += 1

    threads = [threading.Thread(target=count_up) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with database.read() as session:
        assert session.get_one(Run, "mill").step == 100


def test_a_locked_database_gives_up_after_its_timeout(
    database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("labels_db.database.BUSY_TIMEOUT_MS", 50)
    second, start = Database(database.path), time.monotonic()
    with database.write() as session:
        given.a_run(session)
        with pytest.raises(OperationalError, match="locked"), second.write() as late:
            late.get(Run, "mill")
    assert time.monotonic() - start < 5
    second.close()


def test_any_folder_name_will_do(tmp_path: Path) -> None:
    odd = DataFolder(tmp_path / "what? a #1 folder, 100%")
    odd.open_database().close()
    assert odd.database_path.exists()


def test_times_come_back_in_utc(database: Database) -> None:
    berlin = timezone(timedelta(hours=1))
    with database.write() as session:
        given.a_run(session, at=NOW.astimezone(berlin) + SECOND)
    with database.read() as session:
        kept = session.get_one(Run, "mill").queued_at
    assert kept == NOW + SECOND
    assert kept.utcoffset() == timedelta(0)


def test_a_time_without_zone_is_refused(database: Database) -> None:
    naive = datetime(2026, 1, 1)
    with pytest.raises(StatementError, match="has no zone"), database.write() as session:
        given.a_run(session, at=naive)
