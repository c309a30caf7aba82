"""A run's feedback sessions in the record: what asking reads of them, and what it writes."""

from __future__ import annotations

from dataclasses import dataclass

from labels_db.claims import Claim, owned_run
from labels_db.database import Database
from labels_db.feedback_progress import FeedbackProgress, feedback_progress
from labels_db.feedback_sessions import (
    find_session,
    open_session,
    session_queries,
    supersede_queries,
    trim_session,
)
from labels_db.models import FeedbackSession
from labels_db.runs import get_run, note


@dataclass(frozen=True)
class SessionRecord:
    """The sessions of a claimed run, by whichever attempt they were opened."""

    database: Database
    claim: Claim

    def find(self, index: int) -> FeedbackSession | None:
        """Session `index`, if any attempt has opened it."""
        with self.database.read() as session:
            return find_session(session, self.claim.run_id, index)

    def numbered(self, session_id: int) -> FeedbackSession:
        """The session of that id, which is there."""
        with self.database.read() as session:
            return session.get_one(FeedbackSession, session_id)

    def counted(self) -> FeedbackProgress:
        """What has been asked and answered up to now."""
        with self.database.read() as session:
            return feedback_progress(session, get_run(session, self.claim.run_id))

    def size(self, index: int, wanted: int) -> int:
        """What session `index` asks: as before where an earlier attempt opened it, else what the budget allows."""
        if found := self.find(index):
            return found.asked
        counted = self.counted()
        return max(0, min(wanted, counted.remaining - counted.open - counted.rendering))

    def first_to_ask(self, index: int) -> int:
        """From `index` on, the first session not known to be empty: adopting one would ask nothing, for ever.

        Nothing could be drawn of those when an earlier attempt opened them.
        """
        while (found := self.find(index)) and not found.asked:
            index += 1
        return index

    def posted(self, opened: FeedbackSession) -> set[int]:
        """The indices of its queries that are posted."""
        with self.database.read() as session:
            return {query.index for query in session_queries(session, opened.id)}

    def open(self, index: int, *, step: int, asked: int, segment_return: float | None) -> FeedbackSession:
        """Session `index`; one that an earlier attempt opened is adopted."""
        with self.database.write() as session:
            return open_session(
                session, self.claim, index=index, step=step, asked=asked, segment_return=segment_return
            )

    def trim(self, opened: FeedbackSession) -> None:
        """It asks no more than has been posted."""
        with self.database.write() as session:
            trim_session(session, self.claim, opened.id)

    def supersede(self, *, before: int) -> None:
        """Close what is open of the sessions before that index."""
        with self.database.write() as session:
            supersede_queries(session, self.claim, before=before)

    def note(self, text: str) -> None:
        """Say it in the run's history."""
        with self.database.write() as session:
            note(session, owned_run(session, self.claim), text)
