"""What other processes do to a record in tests; each opens it by its path, as a real one would."""

from __future__ import annotations

import random
import sys
from pathlib import Path

from labels_db.answers import answer_query
from labels_db.claims import claim_run
from labels_db.data_folder import DataFolder
from labels_db.database import Database
from labels_db.leases import labeller_named, lease_queries
from labels_db.models import Pressed, utc_now


def claim_until_none(path: Path) -> list[str]:
    """Claim queued runs one by one; returns whose owner this process became."""
    database = Database(path)
    owned: list[str] = []
    while True:
        with database.write() as session:
            claimed = claim_run(session, "worker", max_parallel=1000, now=utc_now())
        if claimed is None:
            return owned
        owned.append(claimed.run_id)


def answer_until_none(path: Path, name: str) -> list[str]:
    """Answer whatever the run `mill` has for a labeller of that name; returns the answers' ids."""
    database = Database(path)
    given: list[str] = []
    while answer_id := answer_one(database, name, len(given)):
        given.append(answer_id)
    return given


def answer_one(database: Database, name: str, number: int) -> str | None:
    """Lease and answer one query in one transaction, as the server does."""
    with database.write() as session:
        person, now = labeller_named(session, name).id, utc_now()
        leases = lease_queries(session, "mill", person, count=1, now=now, rng=random.Random())
        if not leases:
            return None
        answer_id = f"{name}-{number}"
        answer_query(session, leases[0].id, person, answer_id=answer_id, pressed=Pressed.LEFT, now=now)
    return answer_id


def answer_aloud(path: Path) -> None:
    """Answer until killed, printing the id of each answer once it is committed."""
    database, number = Database(path), 0
    while answer_id := answer_one(database, "ann", number):
        print(answer_id, flush=True)
        number += 1


def open_record(folder: Path) -> int:
    """Open, which creates or migrates; returns how many tables there are."""
    database = DataFolder(folder).open_database()
    with database.read() as session:
        tables = session.connection().exec_driver_sql("SELECT count(*) FROM sqlite_master WHERE type='table'")
        return int(tables.scalar_one())


if __name__ == "__main__":
    answer_aloud(Path(sys.argv[1]))
