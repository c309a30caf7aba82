"""Opening feedback sessions: how much may be asked, which pairs, and standing still for people."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any

import structlog
from torch import Tensor

from labels_db.claims import Claim
from labels_db.database import Database
from labels_db.feedback_progress import Inbox, feedback_progress
from labels_db.feedback_sessions import (
    find_session,
    open_session,
    session_queries,
    supersede_queries,
    trim_session,
)
from labels_db.models import FeedbackSession, Phase, RunState
from labels_db.run_config import Asking, Uniform
from labels_db.runs import get_run, note
from trainer.posting import Asked, Desk
from trainer.progress import Progress
from trainer.query_selection import Chosen, Selection, select
from trainer.reward_model import RewardModel
from trainer.segments import PairSampler, SegmentData

log = structlog.get_logger()


@dataclass
class Where:
    """How far asking has come; part of a checkpoint."""

    index: int = 0
    next_step: int = 0
    opened_step: int = 0
    cursor: int = 0
    news_step: int = 0
    news_sequence: int = 0
    told_shortage: bool = False


@dataclass
class Asker:
    """Opens sessions and hands their pairs to the desk, which posts them for its kind of teacher."""

    config: Asking
    database: Database
    claim: Claim
    progress: Progress
    sampler: PairSampler
    model: RewardModel
    desk: Desk
    checkpoint: Callable[[], None]
    obey: Callable[[], None]
    fitted: Callable[[], bool]
    asked: Callable[[], Tensor]
    """Both segments' observations of every preference so far, [n, 2·H·D]."""
    where: Where = field(default_factory=Where)
    asks: list[Asked] = field(default_factory=list)
    _may_be_left: bool = True

    def remaining(self) -> int:
        """Answers the budget still wants."""
        with self.database.read() as session:
            return feedback_progress(session, get_run(session, self.claim.run_id)).remaining

    def session_size(self, wanted: int) -> int:
        """What the next session asks: as before where an earlier attempt opened it, else what the budget allows."""
        with self.database.read() as session:
            found = find_session(session, self.claim.run_id, self.where.index)
            counted = feedback_progress(session, get_run(session, self.claim.run_id))
        return (
            found.asked
            if found
            else max(0, min(wanted, counted.remaining - counted.open - counted.rendering))
        )

    def is_left_open(self, step: int) -> bool:
        """Whether an earlier attempt opened the next session by this step: what is missing of it is nobody's to post.

        It is to be adopted before anything is waited for.
        """
        if self._may_be_left:
            with self.database.read() as session:
                found = find_session(session, self.claim.run_id, self.where.index)
            self._may_be_left = found is not None
            return found is not None and found.step <= step
        return False

    def can_draw(self) -> bool:
        """Whether there are two segments to ask about, now that it is time; the history tells the first time not."""
        if self.sampler.can_draw():
            return True
        if not self.where.told_shortage and (shortage := self.sampler.shortage()):
            self.where.told_shortage = True
            if self.remaining():
                self._tell(shortage)
        return False

    def _tell(self, shortage: str) -> None:
        text = (
            f"Nothing can be asked yet: {shortage}. Wait until episodes last longer,"
            " or start another run with a smaller feedback.segment_steps."
        )
        log.warning(text)
        with self.database.write() as session:
            note(session, get_run(session, self.claim.run_id), text)

    def drew_nothing(self) -> bool:
        """Whether no pair could be drawn of the two sessions before the last: one clip may fail by itself."""
        with self.database.read() as session:
            earlier = [find_session(session, self.claim.run_id, self.where.index - back) for back in (2, 3)]
        return all(found is not None and not found.asked for found in earlier)

    def _step_over_empty_sessions(self) -> None:
        """Sessions of an earlier attempt of which nothing could be drawn: adopting one would ask nothing, for ever."""
        with self.database.read() as session:
            while (found := find_session(session, self.claim.run_id, self.where.index)) and not found.asked:
                self.where.index += 1

    def open(self, step: int, wanted: int) -> bool:
        """Ask up to `wanted` pairs in a new session, or what an earlier attempt left unposted of it.

        False when the budget allows none.

        The checkpoint comes first: an attempt that goes on from it draws the same pairs and finds the same rows.
        """
        self._step_over_empty_sessions()
        count = self.session_size(wanted)
        if not count:
            return False
        self.progress.phase(Phase.ASKING)
        self.checkpoint()
        with self.database.write() as session:
            opened = open_session(
                session,
                self.claim,
                index=self.where.index,
                step=step,
                asked=count,
                segment_return=self.sampler.average_return(),
            )
        chosen = self._choose(opened.asked)
        self.where.index += 1
        self.where.opened_step = step
        self._post(Asked(opened, dict(enumerate(chosen))))
        self.progress.listen()
        return True

    def _choose(self, count: int) -> list[Chosen]:
        """Uniform until the first fit: the ensemble knows nothing yet (algorithm, section 5)."""
        scheme = self.config.scheme if self.fitted() else Uniform()
        wanted = Selection(self.sampler, self.model, count, self.config.candidates_per_query, self.asked)
        return select(scheme, wanted)

    def _post(self, asked: Asked) -> None:
        """Post what is not posted yet of that session."""
        with self.database.read() as session:
            posted = {query.index for query in session_queries(session, asked.session.id)}
        missing = {index: chosen for index, chosen in asked.pairs.items() if index not in posted}
        self.asks = [*[a for a in self.asks if not self.desk.has_posted(a)], asked]
        self.desk.ask(Asked(asked.session, missing))

    def supersede(self) -> None:
        """Close what is still open: fresher pairs take its place, and it costs no budget."""
        self.desk.withdraw()
        self.asks = []
        with self.database.write() as session:
            supersede_queries(session, self.claim, before=self.where.index)

    # Standing still ------------------------------------------------------------------------------

    def news(self, step: int) -> Inbox:
        """The latest inbox; remembers when answers last came."""
        inbox = self._listen()
        if inbox.sequence != self.where.news_sequence:
            self.where.news_sequence, self.where.news_step = inbox.sequence, step
        return inbox

    def wait(self, step: int, until: Callable[[Inbox], bool]) -> Inbox:
        """Say for how many answers training waits, and obey people meanwhile."""
        while not until(inbox := self._listen()):
            self.progress.phase(Phase.WAITING, RunState.WAITING, wanted_answers=inbox.open + inbox.rendering)
            self.obey()
            time.sleep(0.05)
        return self.news(step)

    def _listen(self) -> Inbox:
        self.desk.check()
        return self.progress.check()

    # Checkpoints ---------------------------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        unposted = [asked for asked in self.asks if not self.desk.has_posted(asked)]
        return {**asdict(self.where), "asks": [_to_state(asked) for asked in unposted]}

    def load(self, state: dict[str, Any]) -> None:
        """Go on from there: post again what had been asked and not yet posted."""
        asks = state.pop("asks")
        self.where = Where(**state)
        for saved in asks:
            self._ask_again(saved)

    def _ask_again(self, saved: dict[str, Any]) -> None:
        with self.database.read() as session:
            opened = session.get_one(FeedbackSession, saved["session"])
        pairs = self._pairs_from(saved["pairs"])
        if pairs is not None:
            self._post(Asked(opened, pairs))
        else:
            with self.database.write() as session:
                trim_session(session, self.claim, opened.id)

    def _pairs_from(self, saved: dict[int, Any]) -> dict[int, Chosen] | None:
        """The saved pairs, or None when their episodes have left the pool."""
        episodes = {episode.number: episode for episode in self.sampler.pool.episodes}
        segments = [segment for row in saved.values() for segment in row["segments"]]
        if not {number for number, _ in segments} <= set(episodes):
            return None
        length = self.sampler.length
        return {
            index: Chosen(
                tuple(SegmentData(episodes[n], start, length) for n, start in row["segments"]),  # type: ignore[arg-type]
                row["scheme"],
                row["score"],
            )
            for index, row in saved.items()
        }


def _to_state(asked: Asked) -> dict[str, Any]:
    pairs = {
        index: {
            "segments": [[segment.episode.number, segment.start] for segment in chosen.pair],
            "scheme": chosen.scheme,
            "score": chosen.score,
        }
        for index, chosen in asked.pairs.items()
    }
    return {"session": asked.session.id, "pairs": pairs}
