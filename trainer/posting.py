"""Posting: a chosen pair becomes artifacts, then rows, then something a teacher can answer.

A row appears only when what it points at exists, so segments and clips are in the store before.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from concurrent.futures import Future
from dataclasses import dataclass
from itertools import chain, pairwise
from typing import Protocol

import structlog

from labels_db.database import Database
from labels_db.feedback_sessions import close_unwanted, post_query, session_queries, trim_session
from labels_db.models import FeedbackSession, QueryState, utc_now
from labels_db.runs import get_run, note
from trainer.query_selection import Chosen
from trainer.rendering import (
    CLIP_SECONDS,
    EncodedClip,
    Renderer,
    RenderingError,
    RenderingLost,
    RenderingUnavailable,
    drawn,
)
from trainer.segments import SegmentData
from trainer.shelf import Shelf
from trainer.teachers import ScriptedTeacher, answer_all

log = structlog.get_logger()

Clips = tuple[Future[EncodedClip], Future[EncodedClip]]


@dataclass(frozen=True)
class Asked:
    """A feedback session and pairs of it, by index."""

    session: FeedbackSession
    pairs: dict[int, Chosen]


class Desk(Protocol):
    """Where pairs are handed in to be asked."""

    def ask(self, asked: Asked) -> None:
        """Post the pairs, now or as they become ready."""

    def has_posted(self, asked: Asked) -> bool:
        """Whether nothing of that session is still to come."""

    def withdraw(self) -> None:
        """Post nothing more of what has been asked so far."""

    def check(self) -> None:
        """Raise what went wrong since."""

    def close(self) -> None:
        """End what runs in the background."""


@dataclass(frozen=True)
class ScriptedDesk:
    """Posts a whole session and its answers in one transaction: a scripted teacher needs no clip."""

    database: Database
    shelf: Shelf
    name: str
    teacher: ScriptedTeacher

    def ask(self, asked: Asked) -> None:
        rows = {i: self.shelf.pair(asked.session, i, chosen.pair) for i, chosen in asked.pairs.items()}
        with self.database.write() as session:
            for index, chosen in asked.pairs.items():
                post_query(
                    session,
                    self.shelf.claim,
                    asked.session,
                    index=index,
                    segments=rows[index],
                    scheme=chosen.scheme,
                    score=chosen.score,
                )
            queries = session_queries(session, asked.session.id)
            answer_all(session, self.name, self.teacher, [q for q in queries if q.state is QueryState.OPEN])

    def has_posted(self, asked: Asked) -> bool:
        return True

    def withdraw(self) -> None:
        """Nothing is ever still to come."""

    def check(self) -> None:
        """Whatever went wrong was raised at once."""

    def close(self) -> None:
        """Nothing runs in the background."""


class PeoplesDesk:
    """Posts queries one by one as their clips are ready, from a thread of its own."""

    def __init__(
        self, database: Database, shelf: Shelf, renderer: Renderer, step_seconds: float, answers_needed: int
    ) -> None:
        self.database = database
        self.shelf = shelf
        self.renderer = renderer
        self.step_seconds = step_seconds
        self.answers_needed = answers_needed
        self._failure: Exception | None = None
        self._withdrawn = threading.Event()
        self._threads: list[threading.Thread] = []
        self._posted: set[int] = set()

    def ask(self, asked: Asked) -> None:
        """Render and post in order while training goes on."""
        thread = threading.Thread(
            target=self._guarded, args=(asked, self._withdrawn), name="posting", daemon=True
        )
        self._threads = [*[t for t in self._threads if t.is_alive()], thread]
        thread.start()

    def has_posted(self, asked: Asked) -> bool:
        return asked.session.id in self._posted

    def withdraw(self) -> None:
        self._withdrawn.set()
        for thread in self._threads:
            thread.join()
        self._withdrawn, self._threads = threading.Event(), []

    def check(self) -> None:
        if self._failure is not None:
            raise self._failure

    def close(self) -> None:
        self.withdraw()

    # In the thread -------------------------------------------------------------------------------

    def _guarded(self, asked: Asked, withdrawn: threading.Event) -> None:
        try:
            if self._post_all(asked, withdrawn):
                self._posted.add(asked.session.id)
        except Exception as error:  # a lost attempt, a full disk or no OpenGL ends the run, with its reason
            self._failure = error

    def _post_all(self, asked: Asked, withdrawn: threading.Event) -> bool:
        """Post every pair, as far as it can be drawn; False when withdrawn in the middle."""
        failed = 0
        try:
            for index, clips in self._one_ahead(asked):
                if withdrawn.is_set():
                    return False
                failed += not self._post_drawn(asked, index, clips)
        except RenderingLost as error:
            self._ask_no_more(asked, f"Clips can no longer be rendered: {error}")
        if failed:
            self._ask_no_more(asked, f"{failed} queries could not be drawn and are not asked.")
        return True

    def _one_ahead(self, asked: Asked) -> Iterator[tuple[int, Clips]]:
        """One pair is drawn ahead of the one being posted; no more, since a session may be withdrawn."""
        ordered = ((index, self._order(chosen)) for index, chosen in asked.pairs.items())
        for order, _ in pairwise(chain(ordered, [None])):
            assert order is not None
            yield order

    def _order(self, chosen: Chosen) -> Clips:
        first, second = chosen.pair
        return self._clip(first), self._clip(second)

    def _clip(self, segment: SegmentData) -> Future[EncodedClip]:
        moments = segment.moments
        seconds = self.step_seconds * segment.length / len(moments)
        return self.renderer.clip(segment.episode.seed, moments, seconds)

    def _post_drawn(self, asked: Asked, index: int, clips: Clips) -> bool:
        """Post the query once its clips are drawn; False when one of them cannot be."""
        try:
            first, second = (drawn(clip, CLIP_SECONDS) for clip in clips)
        except (RenderingLost, RenderingUnavailable):
            raise
        except RenderingError as error:
            log.error(
                "a query could not be drawn", session=asked.session.index, query=index, reason=str(error)
            )
            return False
        self._post(asked, index, first, second)
        return True

    def _post(self, asked: Asked, index: int, first: EncodedClip, second: EncodedClip) -> None:
        chosen = asked.pairs[index]
        segments = self.shelf.pair(asked.session, index, chosen.pair, (first, second))
        with self.database.write() as session:
            post_query(
                session,
                self.shelf.claim,
                asked.session,
                index=index,
                segments=segments,
                scheme=chosen.scheme,
                score=chosen.score,
                answers_needed=self.answers_needed,
            )
            close_unwanted(session, get_run(session, self.shelf.claim.run_id), utc_now())

    def _ask_no_more(self, asked: Asked, reason: str) -> None:
        """The run goes on with what has been posted of the session, and says why."""
        log.error(reason)
        with self.database.write() as session:
            trim_session(session, self.shelf.claim, asked.session.id)
            note(session, get_run(session, self.shelf.claim.run_id), reason)
