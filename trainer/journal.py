"""What a run writes down as it goes: fits, evaluations, videos. A replayed run writes nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Protocol

import structlog

from labels_db.claims import Claim
from labels_db.database import Database
from labels_db.errors import RecordError
from labels_db.numbers import number
from labels_db.records import FitReport, attach_video, record_evaluation, record_fit
from labels_db.runs import get_run, note
from labels_db.storage import ArtifactStore
from trainer.evaluation import EvaluatedEpisode, EvaluationError, mean_measures, returns_of

log = structlog.get_logger()


class Journal(Protocol):
    def fit(
        self, *, index: int, step: int, cursor: int, report: FitReport, probabilities: Mapping[int, float]
    ) -> None: ...

    def evaluation(self, step: int, episodes: Sequence[EvaluatedEpisode]) -> None: ...

    def video(self, step: int, video: Future[bytes]) -> None: ...

    def note(self, text: str) -> None: ...


class SilentJournal:
    """Keeps nothing."""

    def fit(
        self, *, index: int, step: int, cursor: int, report: FitReport, probabilities: Mapping[int, float]
    ) -> None:
        """Not kept."""

    def evaluation(self, step: int, episodes: Sequence[EvaluatedEpisode]) -> None:
        """Not kept."""

    def video(self, step: int, video: Future[bytes]) -> None:
        """Not kept."""

    def note(self, text: str) -> None:
        """Not kept."""


class RecordJournal:
    """Writes into the record and the store, as the attempt that owns the run."""

    def __init__(self, database: Database, store: ArtifactStore, claim: Claim) -> None:
        self.database = database
        self.store = store
        self.claim = claim
        self._attaching = ThreadPoolExecutor(1, thread_name_prefix="videos")
        self._videos: list[Future[None]] = []

    def fit(
        self, *, index: int, step: int, cursor: int, report: FitReport, probabilities: Mapping[int, float]
    ) -> None:
        with self.database.write() as session:
            record_fit(
                session,
                self.claim,
                index=index,
                step=step,
                cursor=cursor,
                report=report,
                probabilities=probabilities,
            )

    def evaluation(self, step: int, episodes: Sequence[EvaluatedEpisode]) -> None:
        """A return that is no number is said, not kept: a run on a learned reward goes on without it."""
        try:
            returns = returns_of(episodes)
        except EvaluationError as error:
            self.note(f"The evaluation at step {number(step)} is left out: {error}.")
            return
        with self.database.write() as session:
            record_evaluation(
                session,
                self.claim,
                step=step,
                returns=returns,
                measures=mean_measures(episodes),
                video_key=None,
            )

    def video(self, step: int, video: Future[bytes]) -> None:
        """Attach the video once it is rendered; a lost one costs nothing but itself."""
        self._videos.append(self._attaching.submit(self._attach, step, video))

    def wait_for_videos(self, seconds: float) -> None:
        """Called before the run ends, since nothing can be attached afterwards."""
        late = wait(self._videos, timeout=seconds).not_done
        if late:
            log.warning("videos not rendered in time", count=len(late))
        self._attaching.shutdown(wait=False, cancel_futures=True)

    def _attach(self, step: int, video: Future[bytes]) -> None:
        key = f"runs/{self.claim.run_id}/videos/a{self.claim.attempt}-{step}.mp4"
        try:
            self.store.write(key, video.result())
            with self.database.write() as session:
                attach_video(session, self.claim, step=step, video_key=key)
        except Exception as error:  # a video that fails must not end the run
            log.warning("no video of this evaluation", step=step, reason=str(error))

    def note(self, text: str) -> None:
        try:
            with self.database.write() as session:
                note(session, get_run(session, self.claim.run_id), text)
        except RecordError as error:
            log.warning("note not kept", text=text, reason=str(error))
