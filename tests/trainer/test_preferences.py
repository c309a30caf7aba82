"""The preference dataset is a pure function of the answers, in order."""

from __future__ import annotations

from dataclasses import dataclass, field

import torch
from hypothesis import given
from hypothesis import strategies as st

from labels_db.database import Database
from labels_db.models import Choice, Pressed
from labels_db.storage import ArtifactError
from tests.labels_db import given as record
from tests.trainer.conftest import Lab
from trainer.preferences import AnsweredQueries, Said, asked_about, labels_of


def said(number: int, query: int, choice: Choice | None, retracts: int | None = None) -> Said:
    return Said(number, query, choice, retracts)


def test_each_choice_in_the_querys_own_order() -> None:
    answers = [
        said(1, 10, Choice.FIRST),
        said(2, 11, Choice.SECOND),
        said(3, 12, Choice.EQUAL),
        said(4, 13, Choice.SKIP),
    ]
    assert labels_of(answers) == {10: 0.0, 11: 1.0, 12: 0.5}


def test_several_labellers_average_and_skips_say_nothing() -> None:
    answers = [
        said(1, 10, Choice.FIRST),
        said(2, 10, Choice.SECOND),
        said(3, 10, Choice.SECOND),
        said(4, 10, Choice.SKIP),
    ]
    assert labels_of(answers) == {10: 2 / 3}


def test_a_retraction_removes_and_a_new_answer_counts_again() -> None:
    answers = [said(1, 10, Choice.FIRST), said(2, 10, None, retracts=1)]
    assert labels_of(answers) == {}
    assert labels_of([*answers, said(3, 10, Choice.SECOND)]) == {10: 1.0}


def test_an_answer_taken_back_was_given_all_the_same() -> None:
    answers = [said(1, 10, Choice.FIRST), said(2, 11, Choice.SKIP), said(3, 10, None, retracts=1)]
    assert asked_about(answers) == {10}  # a new answer about it is not news


@given(
    st.lists(st.tuples(st.integers(0, 5), st.sampled_from(list(Choice))), max_size=20),
    st.sets(st.integers(0, 19)),
)
def test_retracting_is_the_same_as_never_having_answered(
    given_answers: list[tuple[int, Choice]], retracted: set[int]
) -> None:
    answers = [said(i, query, choice) for i, (query, choice) in enumerate(given_answers)]
    undone = [i for i in sorted(retracted) if i < len(answers)]
    retractions = [said(100 + i, answers[i].query_id, None, retracts=i) for i in undone]
    kept = [answer for answer in answers if answer.id not in undone]
    assert labels_of([*answers, *retractions]) == labels_of(kept)


@dataclass
class EmptyStore:
    """Has nothing, and tells what was sought; nobody may be in the record meanwhile."""

    database: Database
    sought: list[str] = field(default_factory=list)

    def read(self, key: str, _checksum: str) -> bytes:
        assert self.database.engine.pool.checkedout() == 0  # type: ignore[attr-defined]
        self.sought.append(key.rpartition("/")[2])
        raise ArtifactError(f"{key}: not there")


def test_segments_are_read_outside_the_record_and_only_where_there_is_something_to_learn(lab: Lab) -> None:
    with lab.database.write() as session:
        record.queries(session, record.a_claim(session), 3)
        leases = record.leases(session, record.labeller(session), 3)
        for lease, pressed in zip(leases, (Pressed.LEFT, Pressed.SKIP, Pressed.EQUAL), strict=True):
            record.an_answer(session, lease, f"a-{lease.id}", pressed=pressed)
        pairs = [lease.query.index for lease in leases]
    store = EmptyStore(lab.database)
    answered = AnsweredQueries(lab.database, store, "mill", torch.device("cpu"))  # type: ignore[arg-type]
    assert answered.up_to(3) == ({}, {})
    assert store.sought == [str(2 * pairs[0]), str(2 * pairs[2])]  # the first of each is lost already
