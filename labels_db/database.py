"""The database: one SQLite file, opened so that no committed answer can be lost.

Reads and writes take separate paths: a write begins with BEGIN IMMEDIATE, so that two writers queue up
instead of failing half-way, and stays short; a read refuses to write, since nothing would commit it.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

import pysqlite3.dbapi2 as sqlite
from sqlalchemy import URL, Connection, Engine, create_engine, event
from sqlalchemy.orm import Session

BUSY_TIMEOUT_MS = 30_000
JOURNAL_RETRY_S = 0.02
_WRITES = "writes"


def wal_is_safe(version: tuple[int, int, int]) -> bool:
    """Whether that SQLite is free of the WAL reset bug (sqlite.org/wal.html), which corrupts databases."""
    return version >= (3, 51, 3) or version in {(3, 50, 7), (3, 44, 6)}


class Database:
    """Sessions on the record of one installation."""

    def __init__(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self.path = path
        self.engine = create_engine(URL.create("sqlite", database=str(path)), module=sqlite)
        event.listen(self.engine, "connect", _configure)
        event.listen(self.engine, "begin", _begin)
        self._writer = self.engine.execution_options(**{_WRITES: True})

    @contextmanager
    def read(self) -> Iterator[Session]:
        """A session on one snapshot; what it loads stays usable after it ends."""
        with _session(self.engine) as session:
            yield session

    @contextmanager
    def write(self) -> Iterator[Session]:
        """A session that holds the write lock from its first statement and commits at its end."""
        with _session(self._writer) as session, session.begin():
            yield session

    @contextmanager
    def rebuild(self) -> Iterator[Connection]:
        """A write transaction in which tables may be dropped and copied; foreign keys are checked at its end.

        With foreign keys on, dropping a table would first delete its rows and all that depends on them.
        """
        with self._writer.connect() as connection:
            driver: Any = connection.connection.driver_connection
            driver.execute("PRAGMA foreign_keys=OFF")  # has no effect inside a transaction
            try:
                with connection.begin():
                    yield connection
                    _expect_whole(connection)
            finally:
                driver.execute("PRAGMA foreign_keys=ON")

    def close(self) -> None:
        """Give back every connection; `with` does so at its end."""
        self.engine.dispose()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _session(engine: Engine) -> Session:
    return Session(engine, expire_on_commit=False)


def _configure(connection: Any, _record: Any) -> None:
    connection.isolation_level = None  # transactions begin where `_begin` says, not where the driver guesses
    cursor = connection.cursor()
    cursor.execute(f"PRAGMA busy_timeout={BUSY_TIMEOUT_MS}")
    _keep_journal(cursor, "WAL" if wal_is_safe(sqlite.sqlite_version_info) else "TRUNCATE")
    for pragma in ("synchronous=FULL", "foreign_keys=ON"):
        cursor.execute(f"PRAGMA {pragma}")
    cursor.close()


def _keep_journal(cursor: Any, mode: str) -> None:
    """Set the journal's mode, waiting for others: SQLite's own busy timeout does not cover its change."""
    patience = time.monotonic() + BUSY_TIMEOUT_MS / 1000
    while True:
        try:
            cursor.execute(f"PRAGMA journal_mode={mode}")
            return
        except sqlite.OperationalError as error:
            if error.sqlite_errorcode != sqlite.SQLITE_BUSY or time.monotonic() > patience:
                raise
            time.sleep(JOURNAL_RETRY_S)


def _begin(connection: Connection) -> None:
    writes = connection.get_execution_options().get(_WRITES, False)
    connection.exec_driver_sql(f"PRAGMA query_only={'OFF' if writes else 'ON'}")
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


def _expect_whole(connection: Connection) -> None:
    broken = connection.exec_driver_sql("PRAGMA foreign_key_check").all()
    if broken:
        raise RuntimeError(f"a migration left rows that point nowhere: {broken[:3]}")
