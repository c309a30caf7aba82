"""Who may have which query, for how long, and on which sides."""

from __future__ import annotations

import random

import pytest
from sqlalchemy.orm import Session

from labels_db import leases, runs
from labels_db.database import Database
from labels_db.errors import ConflictError, NotFoundError
from labels_db.leases import LEASE_TIME
from labels_db.models import RunState
from tests.labels_db import given
from tests.labels_db.given import NOW, SECOND

EXPIRED = NOW + LEASE_TIME + SECOND


def _asked(session: Session, count: int, *, answers_needed: int = 1) -> tuple[int, int]:
    """That many queries, and Ann and Bob."""
    given.queries(session, given.a_claim(session), count, answers_needed=answers_needed)
    return given.labeller(session, "ann"), given.labeller(session, "bob")


def test_the_oldest_queries_are_lent_first(database: Database) -> None:
    with database.write() as session:
        ann, bob = _asked(session, 3)
        assert [lease.query.index for lease in given.leases(session, ann, 2)] == [0, 1]
        assert [lease.query.index for lease in given.leases(session, bob, 2)] == [2]


def test_asking_again_renews_the_same_leases(database: Database) -> None:
    with database.write() as session:
        ann, _bob = _asked(session, 3)
        before = given.leases(session, ann, 2)
        later = NOW + SECOND * 30
        after = given.leases(session, ann, 3, at=later)
        assert [lease.id for lease in after[:2]] == [lease.id for lease in before]
        assert {lease.expires_at for lease in after} == {later + LEASE_TIME}


def test_a_lease_given_back_comes_back_in_its_query_s_place(database: Database) -> None:
    with database.write() as session:
        ann, _bob = _asked(session, 3)
        first, *_ = given.leases(session, ann, 3)
        leases.release_lease(session, first.id, ann, now=NOW)
        assert [lease.query.index for lease in given.leases(session, ann, 3)] == [0, 1, 2]


def test_an_expired_lease_frees_the_query_for_others(database: Database) -> None:
    with database.write() as session:
        ann, bob = _asked(session, 1)
        given.leases(session, ann)
        assert given.leases(session, bob, at=NOW + LEASE_TIME - SECOND) == []
        assert len(given.leases(session, bob, at=EXPIRED)) == 1
        assert given.leases(session, ann, at=EXPIRED) == []


def test_a_lapsed_lease_comes_back_with_the_same_sides(database: Database) -> None:
    with database.write() as session:
        ann, _bob = _asked(session, 1)
        rng = random.Random(3)
        sides = set()
        for minute in range(10):
            at = NOW + minute * 2 * LEASE_TIME
            (lease,) = leases.lease_queries(session, "mill", ann, count=1, now=at, rng=rng)
            sides.add((lease.id, lease.swapped))
        assert len(sides) == 1


def test_sides_are_swapped_for_about_half(database: Database) -> None:
    with database.write() as session:
        ann, _bob = _asked(session, 100)
        swapped = sum(lease.swapped for lease in given.leases(session, ann, 100))
        assert 35 < swapped < 65


def test_a_released_query_is_free_at_once(database: Database) -> None:
    with database.write() as session:
        ann, bob = _asked(session, 1)
        (lease,) = given.leases(session, ann)
        leases.release_lease(session, lease.id, ann, now=NOW)
        assert len(given.leases(session, bob)) == 1


def test_releasing_an_expired_lease_does_not_prolong_it(database: Database) -> None:
    with database.write() as session:
        ann, _bob = _asked(session, 1)
        (lease,) = given.leases(session, ann)
        leases.release_lease(session, lease.id, ann, now=EXPIRED)
        assert lease.expires_at == NOW + LEASE_TIME


def test_nobody_uses_the_lease_of_another(database: Database) -> None:
    with database.write() as session:
        ann, bob = _asked(session, 1)
        (lease,) = given.leases(session, ann)
        with pytest.raises(NotFoundError, match=f"lease {lease.id}: not yours"):
            leases.release_lease(session, lease.id, bob, now=NOW)
        with pytest.raises(NotFoundError, match="lease 99: not yours"):
            leases.own_lease(session, 99, ann)


def test_a_query_that_needs_two_is_lent_to_two(database: Database) -> None:
    with database.write() as session:
        ann, bob = _asked(session, 1, answers_needed=2)
        cat = given.labeller(session, "cat")
        (first,) = given.leases(session, ann)
        (second,) = given.leases(session, bob)
        assert given.leases(session, cat) == []
        given.an_answer(session, first, "ann-1")
        assert given.leases(session, cat) == []
        assert given.leases(session, ann) == []
        assert first.query.state == "open"
        given.an_answer(session, second, "bob-1")
        assert first.query.state == "closed"


def test_a_third_takes_the_place_of_one_who_left(database: Database) -> None:
    with database.write() as session:
        ann, bob = _asked(session, 1, answers_needed=2)
        cat = given.labeller(session, "cat")
        (first,) = given.leases(session, ann)
        given.leases(session, bob)
        given.an_answer(session, first, "ann-1")
        assert len(given.leases(session, cat, at=EXPIRED)) == 1


def test_queries_stay_answerable_when_their_run_has_ended(database: Database) -> None:
    with database.write() as session:
        ann, _bob = _asked(session, 1)
        runs.get_run(session, "mill").state = RunState.FINISHED
        assert len(given.leases(session, ann)) == 1


def test_an_archived_run_lends_nothing(database: Database) -> None:
    with database.write() as session:
        ann, _bob = _asked(session, 1)
        runs.get_run(session, "mill").archived = True
        with pytest.raises(ConflictError, match="run mill: archived"):
            given.leases(session, ann)


def test_a_labeller_is_known_by_name(database: Database) -> None:
    with database.write() as session:
        assert given.labeller(session, "ann") == given.labeller(session, "ann")
        assert given.labeller(session, "ann") != given.labeller(session, "bob")
