"""What tests of whole runs compare, and a way to end them in their middle."""

from __future__ import annotations

import multiprocessing
import os
import signal
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import select

from labels_db.claims import Claim, attempt_died
from labels_db.models import Answer, Fit, Metric, Query, QueryScore, RunState, Segment
from labels_db.records import evaluations_of
from labels_db.run_config import RunConfig
from labels_db.runs import config_of, get_run, resume_run, stop_run
from tests.trainer.conftest import RUN, Lab, new_lab
from trainer.attempt import Attempt
from trainer.checkpoints import Checkpoints
from trainer.replay import digest
from trainer.upkeep import RecordedUpkeep


def weights(lab: Lab) -> str:
    """Digest of the networks and optimisers of the run's last checkpoint."""
    with lab.database.read() as session:
        config = config_of(get_run(session, RUN))
    checkpoints = Checkpoints(lab.database, lab.store, Claim(RUN, 0), config)
    manifest = checkpoints.latest()
    assert manifest is not None
    return digest(checkpoints.state(manifest))


def rows(lab: Lab) -> dict[str, list[Any]]:
    """What the run has recorded, without the times and attempts that differ between any two runs."""
    with lab.database.read() as session:
        return {
            "segments": [
                (s.episode, s.start, s.checksum, s.true_return) for s in session.scalars(select(Segment))
            ],
            "queries": [
                (q.index, q.first_id, q.second_id, q.scheme, q.score, q.state)
                for q in session.scalars(select(Query))
            ],
            "answers": [
                (a.sequence, a.query_id, a.choice, a.answer_id) for a in session.scalars(select(Answer))
            ],
            "fits": [
                (f.index, f.step, f.cursor, f.epochs, f.training_accuracy, f.fresh_accuracy)
                for f in session.scalars(select(Fit))
            ],
            "scores": [(s.query_id, s.probability) for s in session.scalars(select(QueryScore))],
            "metrics": [
                (m.name, m.step, m.value)
                for m in session.scalars(select(Metric))
                if m.name != "steps_per_second"
            ],
            "evaluations": [(e.step, e.returns) for e in evaluations_of(session, RUN)],
        }


def live_until(lab: Lab, step: int) -> RunState | None:
    """Live the run until somebody stops it before that step."""
    before = RecordedUpkeep.before_step

    def stopping(self: RecordedUpkeep, training: Any) -> None:
        if training.step >= step:
            with lab.database.write() as session:
                stop_run(session, RUN)
            self.progress.listen()
        before(self, training)

    attempt = Attempt(lab.data, lab.claim())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(RecordedUpkeep, "before_step", stopping)
        return attempt.live()


@dataclass(frozen=True)
class End:
    """What a finished run came to."""

    rows: dict[str, list[Any]]
    weights: str

    @property
    def fits(self) -> list[int]:
        """At which steps it learned from answers."""
        return [step for _, step, *_ in self.rows["fits"]]


def goes_on_exactly(config: RunConfig, folder: Path, stop_at: int | None = None) -> End:
    """Live the run undisturbed, and once more with a stop at that step: to the same end, which is returned.

    Without a step, the stop comes soon after the first fit.
    """
    whole = _end(config, folder / "whole", None)
    assert stop_at or whole.fits, "it learned from no answers"
    assert whole == _end(config, folder / "resumed", stop_at or whole.fits[0] + 5)
    return whole


def _end(config: RunConfig, folder: Path, stop_at: int | None) -> End:
    lab = new_lab(folder)
    lab.request(config)
    if stop_at is not None:
        assert live_until(lab, stop_at) is RunState.STOPPED
        with lab.database.write() as session:
            resume_run(session, RUN)
    assert lab.live() is RunState.FINISHED
    end = End(rows(lab), weights(lab))
    lab.database.close()
    return end


def die_after_checkpoints(path: Path, run_id: str, attempt: int, count: int) -> None:
    """Live the run in this process, and be killed right after its n-th checkpoint, somewhere in training."""
    save, saved = RecordedUpkeep.save, []

    def dying_save(self: RecordedUpkeep, training: Any, **options: Any) -> None:
        save(self, training, **options)
        saved.append(training.step)
        if len(saved) == count:
            os.kill(os.getpid(), signal.SIGKILL)

    RecordedUpkeep.save = dying_save  # type: ignore[method-assign]
    lab = new_lab(path)
    Attempt(lab.data, Claim(run_id, attempt)).live()


def kill_and_go_on(lab: Lab, target: Any, *arguments: Any) -> None:
    claim = lab.claim()
    process = multiprocessing.get_context("spawn").Process(
        target=target, args=(lab.data.path, RUN, claim.attempt, *arguments)
    )
    process.start()
    process.join()
    assert process.exitcode == -signal.SIGKILL
    with lab.database.write() as session:
        attempt_died(session, claim, "killed by a test")
    assert lab.live() is RunState.FINISHED
