"""Relabelling as a part of a run: it may be stopped, is seen to live, and comes to the same in the end."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import pytest

from labels_db.models import Desired, RunState
from labels_db.runs import get_run, resume_run, stop_run
from tests.trainer.conftest import RUN, Lab, small_config
from tests.trainer.whole_runs import rows, weights
from trainer.replay_buffer import ReplayBuffer
from trainer.upkeep import RecordedUpkeep


def test_stopped_while_relabelling_it_ends_with_the_same_rows_and_weights(
    lab: Lab, undisturbed: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab.request(small_config())
    monkeypatch.setattr(ReplayBuffer, "RELABEL_ROWS", 100)
    obey, phases = RecordedUpkeep.obey, []

    def stopping(self: RecordedUpkeep) -> None:
        if self.progress.status.phase == "relabelling":
            phases.append("relabelling")
            if len(phases) == 2:
                with lab.database.write() as session:
                    stop_run(session, RUN)
                self.progress.listen()
        obey(self)

    monkeypatch.setattr(RecordedUpkeep, "obey", stopping)
    assert lab.live() is RunState.STOPPED
    assert len(phases) == 2  # it did not wait for the other parts
    with lab.database.write() as session:
        resume_run(session, RUN)
    assert lab.live() is RunState.FINISHED
    assert rows(lab) == rows(undisturbed)
    assert weights(lab) == weights(undisturbed)


def test_while_relabelling_it_is_seen_to_live_and_hears_of_a_stop(
    lab: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nobody looks on its behalf: what beats and listens is the run's other thread."""
    lab.request(small_config())
    relabel, beats, late = ReplayBuffer.relabel, set(), time.monotonic() + 200

    def observe() -> None:
        with lab.database.read() as session:
            run = get_run(session, RUN)
        if run.phase == "relabelling":
            beats.add(run.heartbeat_at)
        if len(beats) >= 2 and run.desired is not Desired.STOP:
            with lab.database.write() as session:
                stop_run(session, RUN)

    def lasting(self: ReplayBuffer, reward: Any, between_parts: Callable[[], None]) -> None:
        while time.monotonic() < late:
            relabel(self, reward, between_parts)
            observe()

    monkeypatch.setattr("trainer.progress.BEAT_SECONDS", 0.3)
    monkeypatch.setattr(ReplayBuffer, "relabel", lasting)
    assert lab.live() is RunState.STOPPED
    assert len(beats) >= 2
