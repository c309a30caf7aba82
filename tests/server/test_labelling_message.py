"""Every reason for an empty queue has its sentence."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest

from labels_db.feedback_progress import FeedbackProgress
from labels_db.labelling import Queue
from labels_db.models import Desired, Run, RunState
from server.labelling_message import empty_message

NOW = datetime(2026, 3, 1, 12, 0, tzinfo=UTC)
PROGRESS = FeedbackProgress(budget=50, given=10, preferences=10, skipped=0, open=0, posted=10, rendering=0)


def a_queue(*, place: int | None = None, asks_people: bool = True, progress: Any = None, **run: Any) -> Queue:
    facts = {
        "id": "mill",
        "state": RunState.RUNNING,
        "desired": Desired.RUN,
        "archived": False,
        "step": 5000,
        "steps_per_second": 100.0,
        "next_session_step": None,
        "wanted_answers": 0,
        "heartbeat_at": NOW,
        "phase": "training",
    }
    return Queue(
        run=Run(**{**facts, **run}),
        asks_people=asks_people,
        total_steps=40_000,
        steps_between=2000,
        progress=replace(PROGRESS, **(progress or {})),
        available=0,
        place=place,
        video_step=None,
        fits=0,
    )


CASES = [
    (a_queue(progress={"given": 48}), "training", "in a while"),
    (a_queue(archived=True), "archived", "This run is archived"),
    (a_queue(asks_people=False), "scripted", "scripted teacher"),
    (a_queue(state=RunState.FINISHED), "finished", "It learned from 10 of 50 answers."),
    (a_queue(state=RunState.FAILED), "failed", "broke off at step 5\u202f000"),
    (a_queue(state=RunState.STOPPED), "stopped", "Stopped at step 5\u202f000. Resume continues from there."),
    (a_queue(progress={"given": 50}), "answered", "All 50 answers are given. Thank you. The agent goes on"),
    (a_queue(progress={"given": 50}), "answered", "about 6 min more"),
    (a_queue(progress={"given": 50}, state=RunState.PAUSED), "answered", "once the run goes on."),
    (a_queue(progress={"given": 50}, state=RunState.QUEUED), "answered", "once the run goes on."),
    (
        a_queue(progress={"given": 48}, step=38_500),
        "answered",
        "No more pairs come: the run learns from 48 of 50 answers.",
    ),
    (a_queue(state=RunState.QUEUED, place=1), "queued", "This run is the next to start."),
    (a_queue(state=RunState.QUEUED, place=2), "queued", "behind 1 other run."),
    (a_queue(state=RunState.QUEUED, place=4), "queued", "behind 3 other runs."),
    (a_queue(state=RunState.STARTING), "starting", "starting"),
    (a_queue(state=RunState.PAUSED), "paused", "Paused at step"),
    (a_queue(desired=Desired.PAUSE), "paused", "Paused at step"),
    (a_queue(desired=Desired.STOP), "stopped", "is stopping"),
    (a_queue(heartbeat_at=NOW - timedelta(seconds=40)), "silent", "silent for 40 s"),
    (a_queue(state=RunState.STARTING, heartbeat_at=NOW - timedelta(seconds=40)), "starting", "is starting"),
    (a_queue(progress={"rendering": 3}), "rendering", "3 pairs are being drawn"),
    (a_queue(progress={"open": 1}), "others", "The last pair is with other labellers"),
    (a_queue(state=RunState.WAITING, wanted_answers=6), "waiting", "waits for 6 answers"),
    (a_queue(next_session_step=7000), "training", "next pairs in about 20 s"),
    (a_queue(next_session_step=5000), "training", "any moment now"),
    (a_queue(next_session_step=6000, steps_per_second=None), "training", "in a while"),
    (
        a_queue(phase="fitting", next_session_step=7000),
        "training",
        "The agent is learning from your answers:",
    ),
]


NO_MORE = {"archived", "scripted", "finished", "failed", "stopped", "answered"}


@pytest.mark.parametrize(("queue", "kind", "words"), CASES)
def test_the_reason_is_said(queue: Queue, kind: str, words: str) -> None:
    message = empty_message(queue, NOW)
    assert (message.kind, message.over) == (kind, kind in NO_MORE)
    assert words in message.sentence
    assert message.sentence[0].isupper() or message.sentence[0].isdigit()
    assert message.sentence.endswith(".")


def test_the_wait_shortens_between_heartbeats() -> None:
    queue = a_queue(next_session_step=7000)
    later = empty_message(queue, NOW + timedelta(seconds=4))
    assert later.seconds == pytest.approx(16)
    assert "16 s" in later.sentence
