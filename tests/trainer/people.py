"""A person who answers a run's queries in the background, through the record as the server would."""

from __future__ import annotations

import random
import threading
import time
import uuid
from collections.abc import Callable

import numpy as np

from labels_db.answers import answer_query, pressed_for
from labels_db.database import Database
from labels_db.leases import labeller_named, lease_queries
from labels_db.models import Choice, Pressed, Query, utc_now
from labels_db.run_config import Oracle
from trainer.teachers import judge

Judge = Callable[[Query], Choice]


def by_true_return(query: Query) -> Choice:
    first, second = query.first.true_return, query.second.true_return
    assert first is not None
    assert second is not None
    return judge(Oracle(), (first, second), (first, second), 0.0, np.random.default_rng(0))


class Person:
    """Answers one query at a time until told to go."""

    def __init__(self, database: Database, run_id: str, judge: Judge = by_true_return) -> None:
        self.database, self.run_id, self.judge = database, run_id, judge
        self.rng = random.Random(1)
        self.given = 0
        self._leaving = threading.Event()
        self._thread = threading.Thread(target=self._work, daemon=True)

    def __enter__(self) -> Person:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._leaving.set()
        self._thread.join()

    def _work(self) -> None:
        while not self._leaving.is_set():
            if not self.answer_one():
                time.sleep(0.1)

    def answer_one(self) -> bool:
        """Lease and answer one query; False while there is none."""
        with self.database.write() as session:
            me = labeller_named(session, "Ada").id
            leases = lease_queries(session, self.run_id, me, count=1, now=utc_now(), rng=self.rng)
            if not leases:
                return False
            lease = leases[0]
            pressed: Pressed = pressed_for(self.judge(lease.query), swapped=lease.swapped)
            answer_query(session, lease.id, me, answer_id=str(uuid.uuid4()), pressed=pressed, now=utc_now())
        self.given += 1
        return True
