"""Measures, last values, curves and their means over seeds."""

from __future__ import annotations

import statistics

import pytest
from sqlalchemy.orm import Session

from labels_db.database import Database
from labels_db.evaluation_curves import (
    curves_of,
    evaluated_at,
    last_evaluations,
    mean_curve,
    measures_in,
    spread_of,
    value_of,
)
from labels_db.records import record_evaluation
from tests.labels_db import given


def evaluated(session: Session, run_id: str, returns: dict[int, float], **measures: object) -> None:
    owner = given.a_claim(session, run_id)
    for step, value in returns.items():
        record_evaluation(session, owner, step=step, returns=[value], measures=measures, video_key=None)


def test_only_runs_that_were_evaluated_have_a_last_value(database: Database) -> None:
    with database.write() as session:
        evaluated(session, "a", {100: 1.0, 200: 5.0}, turns=3)
        evaluated(session, "b", {50: 7.0})
        given.a_run(session, "c")
        found = last_evaluations(session, ["a", "b", "c"])
        assert {run_id: each.step for run_id, each in found.items()} == {"a": 200, "b": 50}
        assert (value_of(found["a"], "return"), value_of(found["a"], "turns")) == (5.0, 3.0)
        assert value_of(found["b"], "turns") is None
        assert evaluated_at(found.values()) == found["b"].at.isoformat()
        assert evaluated_at([]) == ""


def test_measures_are_what_can_be_drawn(database: Database) -> None:
    with database.write() as session:
        evaluated(session, "a", {1: 0.0}, upright=True, turns=2, note="fell", tilt=0.5)
        assert measures_in(last_evaluations(session, ["a"]).values()) == ["return", "turns", "tilt"]


def test_curves_are_in_step_order_and_leave_out_what_was_not_measured(database: Database) -> None:
    with database.write() as session:
        evaluated(session, "a", {200: 5.0, 100: 1.0}, turns=3)
        evaluated(session, "b", {50: 7.0})
        assert curves_of(session, ["a", "b"], "return") == {"a": [(100, 1.0), (200, 5.0)], "b": [(50, 7.0)]}
        assert curves_of(session, ["a", "b"], "turns") == {"a": [(100, 3.0), (200, 3.0)]}
        assert curves_of(session, ["b"], "return").keys() == {"b"}


def test_the_mean_is_over_the_steps_that_all_share() -> None:
    curves = [[(10, 1.0), (20, 2.0), (30, 9.0)], [(10, 3.0), (20, 8.0)], [(10, 5.0), (20, 5.0), (40, 0.0)]]
    found = mean_curve(curves)
    assert [(step, spread.mean) for step, spread in found] == [(10, 3.0), (20, 5.0)]
    assert [spread.deviation for _, spread in found] == pytest.approx(
        [statistics.pstdev([1, 3, 5]), statistics.pstdev([2, 8, 5])]
    )
    assert mean_curve([]) == []


def test_no_values_have_no_spread() -> None:
    assert spread_of([]) is None
    single = spread_of([4.0])
    assert single is not None
    assert (single.mean, single.deviation, single.count) == (4.0, 0.0, 1)
