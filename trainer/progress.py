"""The trainer's side of the record: a thread that beats, listens for what people want, and keeps metrics.

A thread of its own, so that a long fit, evaluation or checkpoint never looks dead and the training thread
never waits for a disk. At most one write in 2 s for metrics, one beat in 5 s unless the state changes.
"""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, field
from datetime import UTC, datetime

import structlog

from labels_db.claims import Claim, Report, beat
from labels_db.database import Database
from labels_db.errors import RecordError
from labels_db.feedback_progress import Inbox, read_inbox
from labels_db.models import Desired, Phase, RunState, utc_now
from labels_db.records import Measurement, record_metrics
from trainer.event_files import EventFiles

log = structlog.get_logger()

LISTEN_SECONDS = 0.2
BEAT_SECONDS = 5.0
METRICS_SECONDS = 2.0


@dataclass
class Status:
    """What the training thread says of itself; plain assignments, read by the other thread."""

    state: RunState = RunState.STARTING
    phase: Phase = Phase.STARTING
    step: int = 0
    wanted_answers: int = 0
    next_session_step: int | None = None


@dataclass
class StepRate:
    """Steps per second over about the last ten seconds."""

    history: list[tuple[float, int]] = field(default_factory=list)

    def value(self, now: float, step: int) -> float | None:
        self.history = [*[(t, s) for t, s in self.history if now - t <= 10], (now, step)]
        then, before = self.history[0]
        return (step - before) / (now - then) if now - then > 1 else None


class Progress:
    """Started with the attempt, closed at its end; `status` is written and `inbox` read between steps."""

    def __init__(self, database: Database, claim: Claim, events: EventFiles) -> None:
        self.database = database
        self.claim = claim
        self.status = Status()
        self._events = events
        self._rate = StepRate()
        self._measurements: list[Measurement] = []
        self._lock = threading.Lock()
        self._listening = threading.Lock()
        self._ending = threading.Event()
        self._failure: Exception | None = None
        self._progress = (0, "", utc_now())
        self.listen()
        self._thread = threading.Thread(target=self._run, name="progress", daemon=True)
        self._thread.start()

    # What the training thread calls --------------------------------------------------------------

    def check(self) -> Inbox:
        """The latest inbox; raises what ended the other thread, such as a lost attempt."""
        if self._failure is not None:
            raise self._failure
        return self.inbox

    def listen(self) -> Inbox:
        """Look into the record now."""
        with self._listening:  # two threads listen: the later look must win
            with self.database.read() as session:
                self.inbox = read_inbox(session, self.claim.run_id)
            return self.inbox

    def phase(self, phase: Phase, state: RunState = RunState.RUNNING, *, wanted_answers: int = 0) -> None:
        self.status.phase, self.status.state, self.status.wanted_answers = phase, state, wanted_answers

    def metrics(self, step: int, values: dict[str, float]) -> None:
        with self._lock:
            self._measurements += [Measurement(step, name, value) for name, value in values.items()]

    def close(self) -> None:
        """Write what is left and end the thread; the attempt may have ended already."""
        self._ending.set()
        self._thread.join()
        self._events.close()

    # The other thread ----------------------------------------------------------------------------

    def _run(self) -> None:
        try:
            self._loop()
        except Exception as error:  # whatever ends this thread must end the run, with its reason
            self._failure = error

    def _loop(self) -> None:
        beaten = written = 0.0
        said: tuple[RunState, str] | None = None
        while not self._ending.wait(LISTEN_SECONDS):
            self.listen()
            now, status = time.monotonic(), (self.status.state, self.status.phase)
            if now - beaten > BEAT_SECONDS or (status != said and now - beaten > 0.5):
                self.beat()
                beaten, said = now, status
            if now - written > METRICS_SECONDS:
                self.flush()
                written = now
        self.flush()

    def beat(self) -> Desired:
        """Record a sign of life with the present status."""
        report = self._report()
        if report.steps_per_second is not None and report.state is RunState.RUNNING:
            self.metrics(report.step, {"steps_per_second": report.steps_per_second})
        with self.database.write() as session:
            return beat(session, self.claim, report, now=utc_now())

    def _report(self) -> Report:
        status = self.status
        if (status.step, status.phase) != self._progress[:2]:
            self._progress = (status.step, status.phase, datetime.now(UTC))
        return Report(
            state=status.state,
            phase=status.phase,
            step=status.step,
            steps_per_second=self._rate.value(time.monotonic(), status.step),
            wanted_answers=status.wanted_answers,
            next_session_step=status.next_session_step,
            progress_at=self._progress[2],
        )

    def flush(self) -> None:
        """Keep the metrics gathered so far, in the record and as TensorBoard event files."""
        with self._lock:
            taken, self._measurements = self._measurements, []
        if not taken:
            return
        self._events.write(taken)
        try:
            with self.database.write() as session:
                record_metrics(session, self.claim, taken)
        except RecordError as error:
            log.warning("metrics not kept", reason=str(error))
            raise
