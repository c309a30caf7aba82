"""What a trainer records of itself, and what is forgotten when it goes on from a checkpoint."""

from __future__ import annotations

import pytest
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from labels_db import claims, records, runs
from labels_db.claims import Claim
from labels_db.database import Database
from labels_db.feedback_sessions import open_session
from labels_db.history import sessions_of
from labels_db.models import Metric, QueryScore, RunState
from labels_db.records import FitReport, Measurement
from tests.labels_db import given
from tests.labels_db.given import NOW

REPORT = FitReport(preferences=4, epochs=9, training_accuracy=1.0, fresh_accuracy=None)


def _metrics(session: Session, step: int = -1) -> list[tuple[str, int, float]]:
    found = records.metrics_since(session, "mill", step, ["loss", "alpha"])
    return [(metric.name, metric.step, metric.value) for metric in found]


def _fit(session: Session, owner: Claim, index: int, probabilities: dict[int, float]) -> None:
    records.record_fit(
        session, owner, index=index, step=index, cursor=0, report=REPORT, probabilities=probabilities
    )


def _evaluate(session: Session, owner: Claim, step: int, returns: list[float]) -> None:
    records.record_evaluation(
        session, owner, step=step, returns=returns, measures={"turns": 3}, video_key=None
    )


def test_metrics_are_read_after_a_step_in_order(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        numbers = [Measurement(step, "loss", step / 10) for step in (30, 10, 20)]
        records.record_metrics(session, owner, [*numbers, Measurement(20, "unseen", 1.0)])
        assert _metrics(session, 10) == [("loss", 20, 2.0), ("loss", 30, 3.0)]
        every = records.metrics_since(session, "mill", 10, [])
        assert {(metric.name, metric.step) for metric in every} == {
            ("loss", 20),
            ("unseen", 20),
            ("loss", 30),
        }


def test_a_number_measured_again_replaces_the_earlier(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        records.record_metrics(session, owner, [Measurement(1, "loss", 1.0), Measurement(1, "loss", 2.0)])
        records.record_metrics(session, owner, [Measurement(1, "loss", 3.0), Measurement(1, "alpha", 0.1)])
        assert sorted(_metrics(session)) == [("alpha", 1, 0.1), ("loss", 1, 3.0)]


@pytest.mark.parametrize("value", [float("nan"), float("inf"), float("-inf")])
def test_what_is_no_number_is_left_out(database: Database, value: float) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        records.record_metrics(session, owner, [Measurement(1, "loss", value), Measurement(1, "alpha", 1.0)])
        records.record_metrics(session, owner, [])
        assert _metrics(session) == [("alpha", 1, 1.0)]


def test_a_fit_keeps_its_scores(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        asked = given.queries(session, owner, 2)
        _fit(session, owner, 0, {asked[0].id: 0.25, asked[1].id: 0.75})
        (fit,) = records.fits_of(session, "mill")
        assert (fit.index, fit.epochs, fit.training_accuracy, fit.fresh_accuracy) == (0, 9, 1.0, None)
        scores = session.execute(select(QueryScore.query_id, QueryScore.probability)).all()
        assert {tuple(score) for score in scores} == {(asked[0].id, 0.25), (asked[1].id, 0.75)}


def test_an_evaluation_made_again_replaces_the_earlier(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        _evaluate(session, owner, 100, [1.0, 3.0])
        _evaluate(session, owner, 100, [2.0, 4.0])
        (found,) = records.evaluations_of(session, "mill")
        assert (found.returns, found.mean_return, found.measures) == ([2.0, 4.0], 3.0, {"turns": 3})
        records.attach_video(session, owner, step=100, video_key="runs/mill/videos/100.mp4")
        records.attach_video(session, owner, step=999, video_key="of an evaluation since forgotten")
        assert found.video_key == "runs/mill/videos/100.mp4"
        _evaluate(session, owner, 100, [2.0, 4.0])  # a run that was stopped there, watched and resumed
        (again,) = records.evaluations_of(session, "mill")
        assert again.video_key == "runs/mill/videos/100.mp4"


def test_a_checkpoint_counts_as_progress(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        for step in (1, 2, 3):
            records.record_checkpoint(session, owner, step=step, manifest_key=f"{step}", checksum="c")
        latest, *older = records.checkpoints_of(session, "mill")
        assert (latest.step, latest.attempt, runs.get_run(session, "mill").fruitless_attempts) == (3, 1, 0)
        records.forget_checkpoints(session, owner, [checkpoint.id for checkpoint in older])
        assert [found.step for found in records.checkpoints_of(session, "mill")] == [3]


def test_a_checkpoint_no_later_than_an_earlier_one_is_no_progress(database: Database) -> None:
    """What kills the trainer right after its checkpoint must not be tried for ever."""
    with database.write() as session:
        run = given.a_run(session)
        for attempt in range(claims.MAX_FRUITLESS_ATTEMPTS + 1):
            owner = claims.claim(session, run, "s", now=NOW)
            records.record_checkpoint(session, owner, step=500, manifest_key=str(attempt), checksum="c")
            claims.attempt_died(session, owner, "killed by signal 9")
            if run.state is RunState.FAILED:
                break
        assert (run.state, run.attempt) == (RunState.FAILED, claims.MAX_FRUITLESS_ATTEMPTS + 1)


def test_an_attempts_second_checkpoint_at_a_step_is_progress(database: Database) -> None:
    """Before a session and after its fit: whoever comes from the one to the other has got farther."""
    with database.write() as session:
        run = given.a_run(session)
        for attempt in range(6):
            owner = claims.claim(session, run, "s", now=NOW)
            for moment in ("before the session", "after its fit"):
                records.record_checkpoint(
                    session, owner, step=500, manifest_key=f"{attempt} {moment}", checksum="c"
                )
            claims.attempt_died(session, owner, "killed by signal 9")
        assert run.state is RunState.QUEUED


def test_a_rewind_asks_no_more_of_a_later_session_than_was_posted(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        posted = open_session(session, owner, index=0, step=1000, asked=3)
        given.queries(session, owner, 1)
        open_session(session, owner, index=1, step=2000, asked=3)
        records.rewind(session, owner, step=1000, fits=0)
        assert [record.session.index for record in sessions_of(session, "mill")] == [0]
        assert posted.asked == 3
        records.rewind(session, owner, step=500, fits=0)
        assert posted.asked == 1


def test_a_rewind_forgets_what_will_be_computed_again(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        asked = given.queries(session, owner, 1)
        (lease,) = given.leases(session, given.labeller(session))
        given.an_answer(session, lease)
        for index in range(3):
            _fit(session, owner, index, {asked[0].id: 0.5})
            _evaluate(session, owner, 100 * index, [1.0])
            records.record_metrics(session, owner, [Measurement(100 * index, "loss", 1.0)])
        records.rewind(session, owner, step=100, fits=1)
        assert [fit.index for fit in records.fits_of(session, "mill")] == [0]
        assert [found.step for found in records.evaluations_of(session, "mill")] == [0, 100]
        assert session.scalar(select(func.count()).select_from(Metric)) == 2
        assert session.scalar(select(func.count()).select_from(QueryScore)) == 1
        assert runs.get_run(session, "mill").answer_sequence == 1
        assert asked[0].state == "closed"


def test_a_rewind_touches_no_other_run(database: Database) -> None:
    with database.write() as session:
        owner, other = given.a_claim(session), given.a_claim(session, "other")
        records.record_metrics(session, other, [Measurement(100, "loss", 1.0)])
        _fit(session, other, 0, {})
        records.rewind(session, owner, step=0, fits=0)
        assert len(records.fits_of(session, "other")) == 1
        assert session.scalar(select(func.count()).select_from(Metric)) == 1
