"""A person who answers a run's queries in the background, through the record as the server would."""

from __future__ import annotations

import random
import threading
import time
import uuid
from collections.abc import Callable, Sequence
from typing import Self

import numpy as np
import pytest
from sqlalchemy.orm import Session

from labels_db.answers import answer_query, pressed_for
from labels_db.database import Database
from labels_db.leases import labeller_named, lease_queries
from labels_db.models import Choice, Lease, Pressed, Query, utc_now
from labels_db.run_config import Oracle
from trainer.posting import Asked, PeoplesDesk
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

    def __enter__(self) -> Self:
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
        """Lease queries and answer one; False while there is none."""
        with self.database.write() as session:
            me = labeller_named(session, "Ada").id
            lent = lease_queries(session, self.run_id, me, count=2, now=utc_now(), rng=self.rng)
            lease = self.next_of(session, lent)
            if lease is None:
                return False
            pressed: Pressed = pressed_for(self.judge(lease.query), swapped=lease.swapped)
            answer_query(session, lease.id, me, answer_id=str(uuid.uuid4()), pressed=pressed, now=utc_now())
        self.given += 1
        return True

    def next_of(self, session: Session, lent: Sequence[Lease]) -> Lease | None:
        """What to answer of what is lent."""
        return next(iter(lent), None)


class LatePerson(Person):
    """Answers the first pair only when a later session has superseded it; stops at the budget."""

    def __init__(self, database: Database, run_id: str, budget: int) -> None:
        super().__init__(database, run_id)
        self.budget = budget
        self.kept: int | None = None
        self.was_late = False

    def next_of(self, session: Session, lent: Sequence[Lease]) -> Lease | None:
        if self.given == self.budget or not (lent or self.kept):
            return None
        self.kept = self.kept or lent[0].id
        others = [lease for lease in lent if lease.id != self.kept]
        if len(others) < len(lent) or self.was_late:
            return super().next_of(session, others)
        self.was_late = bool(others)
        return session.get_one(Lease, self.kept) if self.was_late else None


def in_step(person: Person, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every session is posted before training goes on, and the person answers whenever training listens."""
    ask, check = PeoplesDesk.ask, PeoplesDesk.check

    def ask_and_see_it_posted(desk: PeoplesDesk, asked: Asked) -> None:
        ask(desk, asked)
        while not desk.has_posted(asked):
            check(desk)
            time.sleep(0.01)

    def answer_and_check(desk: PeoplesDesk) -> None:
        person.answer_one()
        check(desk)

    monkeypatch.setattr(PeoplesDesk, "ask", ask_and_see_it_posted)
    monkeypatch.setattr(PeoplesDesk, "check", answer_and_check)
