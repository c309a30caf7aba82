"""Scripted teachers: every fault held to its formula by counting, and all of them together."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labels_db.models import Choice, Segment
from labels_db.run_config import Equal, Mistaken, Myopic, Oracle, Scripted, Skipping, Stochastic
from labels_db.storage import ArtifactStore
from trainer.episodes import FinishedEpisode
from trainer.segments import SegmentData
from trainer.teachers import KINDS, ScriptedTeacher, judge, scripted_teacher_named

pytestmark = pytest.mark.contracts

MANY = 20_000
returns = st.floats(-100, 100, allow_nan=False)


def shares(config: Scripted, first: float, second: float, average: float = 10.0) -> dict[Choice, float]:
    """How often each choice is made, each time by other chance."""
    rng = np.random.default_rng(0)
    pair = (first, second)
    made = Counter(judge(config, pair, pair, average, rng) for _ in range(MANY))
    return {choice: count / MANY for choice, count in made.items()}


def nearly(share: float) -> Any:
    """Within four standard deviations of a share of many."""
    return pytest.approx(share, abs=4 * math.sqrt(share * (1 - share) / MANY) + 1e-9)


@given(returns, returns)
def test_an_oracle_prefers_the_larger_return(first: float, second: float) -> None:
    expected = Choice.EQUAL if first == second else Choice.FIRST if first > second else Choice.SECOND
    rng = np.random.default_rng(0)
    assert judge(Oracle(), (first, second), (first, second), 5.0, rng) is expected


@pytest.mark.parametrize("difference", [-2.0, -0.3, 0.5, 1.0])
@pytest.mark.parametrize("rationality", [0.5, 1.0, 3.0])
def test_a_stochastic_teacher_follows_the_softmax(difference: float, rationality: float) -> None:
    found = shares(Stochastic(rationality=rationality), 7.0, 7.0 + difference)
    weights = math.exp(rationality * 7.0), math.exp(rationality * (7.0 + difference))
    assert found[Choice.SECOND] == nearly(weights[1] / sum(weights))


def test_returns_of_any_size_do_not_overflow() -> None:
    assert shares(Stochastic(rationality=1000), -1e6, 1e6) == {Choice.SECOND: 1.0}
    assert shares(Stochastic(rationality=1000), 1e6, -1e6) == {Choice.FIRST: 1.0}


@pytest.mark.parametrize("mistake", [0.1, 0.35, 1.0])
def test_mistakes_turn_the_preference_round(mistake: float) -> None:
    assert shares(Mistaken(mistake=mistake), 1.0, 2.0).get(Choice.FIRST, 0) == nearly(mistake)


def test_a_skipping_teacher_needs_one_segment_that_earns_enough() -> None:
    # The average segment earned 10, so that 0.1 of it is 1.
    assert shares(Skipping(), 0.9, 1.0) == {Choice.SKIP: 1.0}
    assert shares(Skipping(), 0.9, 1.01) == {Choice.SECOND: 1.0}
    assert shares(Skipping(skip=0.5), 4.9, 0.0) == {Choice.SKIP: 1.0}


def test_an_equal_teacher_does_not_tell_small_differences() -> None:
    assert shares(Equal(), 5.0, 5.99) == {Choice.EQUAL: 1.0}
    assert shares(Equal(), 5.0, 6.0) == {Choice.SECOND: 1.0}
    assert shares(Equal(equal=0.5), 5.0, 0.1) == {Choice.EQUAL: 1.0}


def test_a_myopic_teacher_goes_by_what_it_feels() -> None:
    rng = np.random.default_rng(0)
    assert judge(Myopic(), (5.0, 4.0), (1.0, 2.0), 1.0, rng) is Choice.SECOND


@pytest.mark.parametrize(("discount", "felt"), [(1.0, 7.0), (0.5, 0.25 * 1 + 0.5 * 2 + 4)])
def test_a_myopic_teacher_feels_the_last_steps_most(tmp_path: Path, discount: float, felt: float) -> None:
    rows = np.zeros((3, 2), np.float32)
    lived = FinishedEpisode(0, 0, 0, rows, rows, np.array([1, 2, 4], np.float32), rows)
    store = ArtifactStore(str(tmp_path))
    checksum = store.write("segment", SegmentData(lived, 0, 3).to_bytes())
    segment = Segment(artifact_key="segment", checksum=checksum, true_return=7.0)
    assert ScriptedTeacher(Myopic(discount=discount), store, 0)._felt(segment) == pytest.approx(felt)


def test_a_tie_is_equal_or_as_in_the_authors_code_the_first() -> None:
    assert shares(Oracle(), 3.0, 3.0) == {Choice.EQUAL: 1.0}
    assert shares(Oracle(tie="first"), 3.0, 3.0) == {Choice.FIRST: 1.0}
    assert shares(Stochastic(), 3.0, 3.0) == {Choice.EQUAL: 1.0}


def test_faults_compose_in_their_order() -> None:
    every = Oracle(rationality=1.0, mistake=0.2, skip=0.1, equal=0.05)
    assert shares(every, 0.5, 0.9) == {Choice.SKIP: 1.0}  # skipped before it could be called equal
    assert shares(every, 5.0, 5.4) == {Choice.EQUAL: 1.0}  # equal whatever chance and mistakes say
    prefers = 1 / (1 + math.exp(-1.0))
    assert shares(every, 5.0, 6.0)[Choice.SECOND] == nearly(0.8 * prefers + 0.2 * (1 - prefers))


def test_kinds_differ_in_their_defaults_only() -> None:
    faults = {kind: config().model_dump(exclude={"kind"}) for kind, config in KINDS.items()}
    none = faults["oracle"]
    assert none == {
        "rationality": None,
        "discount": 1.0,
        "mistake": 0.0,
        "skip": 0.0,
        "equal": 0.0,
        "tie": "equal",
    }
    assert {kind: dict(values.items() - none.items()) for kind, values in faults.items()} == {
        "oracle": {},
        "stochastic": {"rationality": 1.0},
        "mistake": {"mistake": 0.1},
        "skip": {"skip": 0.1},
        "equal": {"equal": 0.1},
        "myopic": {"discount": 0.9},
    }


def test_an_unknown_kind_names_the_ones_there_are() -> None:
    with pytest.raises(ValueError, match="'wise': unknown; one of oracle, stochastic, mistake"):
        scripted_teacher_named("wise")
