"""One attempt at a run: from its claim to its end, whatever that is."""

from __future__ import annotations

import math
import shutil
import signal
from contextlib import suppress

import structlog

from labels_db.claims import Claim, acknowledge_stop, fail_run, finish_or_go_on, yield_run
from labels_db.data_folder import DataFolder
from labels_db.errors import AttemptLostError
from labels_db.estimate import estimate_bytes
from labels_db.feedback_sessions import supersede_queries
from labels_db.models import RunState
from labels_db.numbers import number
from labels_db.run_config import RunConfig
from labels_db.runs import config_of, get_run, note
from trainer.divergence import divergence
from trainer.evaluation import EvaluatedEpisode, mean_measures
from trainer.recorded_run import RecordedRun, recorded_run
from trainer.upkeep import ShutdownRequestedError, StopRequestedError

log = structlog.get_logger()

VIDEO_SECONDS = 120
"""How long a finished run waits for its last videos."""


class Attempt:
    """Owns a claimed run until it ends; `run` is made at once, so that others can watch its progress."""

    def __init__(self, data: DataFolder, claim: Claim) -> None:
        self.data = data
        self.claim = claim
        self.database = data.open_database()
        self.store = data.open_store()
        self.last_evaluation: list[EvaluatedEpisode] = []
        self._shutdown_asked = False
        self._left_as = RunState.QUEUED
        self.run: RecordedRun | None = None

    def shutdown(self) -> None:
        """End soon, with a checkpoint, so that the run can go on later (signal-safe)."""
        self._shutdown_asked = True
        if self.run is not None:
            self.run.upkeep.shutdown.set()

    def stop(self) -> None:
        """End soon, with a checkpoint, stopped until somebody resumes it (signal-safe)."""
        self._left_as = RunState.STOPPED
        self.shutdown()

    @property
    def last_measures(self) -> dict[str, float]:
        """Mean return and measures of the last evaluation; empty before it."""
        if not self.last_evaluation:
            return {}
        returns = [episode.true_return for episode in self.last_evaluation]
        found = {"return": sum(returns) / len(returns), **mean_measures(self.last_evaluation)}
        return {name: value for name, value in found.items() if math.isfinite(value)}

    def live(self) -> RunState | None:
        """Train until the run finishes, fails or is stopped: the state it is left in; None where it was taken away."""
        try:
            return self._live_or_fail()
        except AttemptLostError as error:
            log.warning("the run belongs to another attempt now", reason=str(error))
            return None
        finally:
            self._close()

    def _live_or_fail(self) -> RunState:
        try:
            return self._live()
        except AttemptLostError:
            raise
        except Exception as error:
            log.exception("the run failed")
            with self.database.write() as session:
                fail_run(session, self.claim, self._reason(error))
            return RunState.FAILED

    def _reason(self, error: Exception) -> str:
        """What went wrong: numbers that are none are the reason of whatever they broke first."""
        if self.run is not None:
            with suppress(Exception):  # a broken run may not even say its state; then the error must do
                error = divergence(self.run.training) or error
        return f"{type(error).__name__}: {error}"

    def _live(self) -> RunState:
        config = self._config()
        if self.claim.attempt == 1:
            self._check_space(estimate_bytes(config).total)
            self._warn(config)
        self.run = recorded_run(config, self.data, self.database, self.store, self.claim)
        if self._shutdown_asked:
            self.run.upkeep.shutdown.set()
        try:
            self.run.training.train()
            if self._config().total_steps > config.total_steps:
                return self._leave(RunState.QUEUED)  # extended meanwhile: goes on with a larger buffer
            return self._finish(self.run, config)
        except StopRequestedError:
            return self._leave(RunState.STOPPED)
        except ShutdownRequestedError:
            return self._leave(self._left_as)

    def _config(self) -> RunConfig:
        with self.database.read() as session:
            return config_of(get_run(session, self.claim.run_id))

    def _finish(self, run: RecordedRun, config: RunConfig) -> RunState:
        self.last_evaluation = run.upkeep.evaluate(run.training)
        self._ask_no_more(run)
        run.upkeep.save(run.training, rows=config.checkpoints.keep_buffer)
        self._say_goodbye(run, VIDEO_SECONDS)
        with self.database.write() as session:
            return finish_or_go_on(session, self.claim, total_steps=config.total_steps)

    def _ask_no_more(self, run: RecordedRun) -> None:
        """Nobody is to answer what can teach nothing any more."""
        run.training.feedback.close()
        with self.database.write() as session:
            supersede_queries(session, self.claim)
        unlearned = run.progress.listen().sequence - run.training.feedback.cursor()
        if unlearned > 0:
            run.journal.note(
                f"Answers after the last fit: {number(unlearned)}. Extend the run to learn from them."
            )

    def _say_goodbye(self, run: RecordedRun, video_seconds: float) -> None:
        run.progress.status.step = run.training.step
        run.journal.wait_for_videos(video_seconds)
        run.progress.beat()
        run.progress.flush()

    def _leave(self, state: RunState) -> RunState:
        """Keep everything, then give the run up: stopped for good, or queued for its next turn."""
        assert self.run is not None
        self.run.upkeep.save(self.run.training)  # before closing: what is still to be posted is part of it
        self.run.training.feedback.close()
        self._say_goodbye(self.run, video_seconds=5)
        leave = acknowledge_stop if state is RunState.STOPPED else yield_run
        with self.database.write() as session:
            leave(session, self.claim)
        return state

    def _check_space(self, needed: int) -> None:
        free = shutil.disk_usage(self.data.path).free
        text = f"Needs about {needed / 1e6:.0f} MB on disk; {free / 1e6:.0f} MB are free."
        if needed > free:
            raise OSError(f"{self.data.path}: {text} Make room, or choose another folder with --data.")
        with self.database.write() as session:
            note(session, get_run(session, self.claim.run_id), text)

    def _warn(self, config: RunConfig) -> None:
        for caveat in config.caveats:
            log.warning(caveat)
            with self.database.write() as session:
                note(session, get_run(session, self.claim.run_id), caveat)

    def _close(self) -> None:
        if self.run is not None:
            self.run.close()
        self.database.close()


def live_in_this_process(data: DataFolder, claim: Claim) -> RunState | None:
    """The whole life of a run's own process: SIGTERM and SIGINT end it with a checkpoint."""
    attempt = Attempt(data, claim)
    for caught in (signal.SIGTERM, signal.SIGINT):
        signal.signal(caught, lambda *_: attempt.shutdown())
    return attempt.live()
