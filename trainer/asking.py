"""Opening feedback sessions: how much may be asked, which pairs, and standing still for people."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import structlog

from labels_db.feedback_progress import Inbox
from labels_db.models import Phase, RunState
from labels_db.run_config import Asking, Uniform
from trainer.asking_state import AskingState, pairs_from, state_of
from trainer.posting import Asked, Desk
from trainer.preferences import AnsweredQueries
from trainer.progress import Progress
from trainer.query_selection import Chosen, Selection, select
from trainer.reward_model import RewardModel
from trainer.segments import PairSampler
from trainer.session_record import SessionRecord

if TYPE_CHECKING:
    from trainer.training import Training

log = structlog.get_logger()


@dataclass
class Asker:
    """Opens sessions and hands their pairs to the desk, which posts them for its kind of teacher."""

    config: Asking
    record: SessionRecord
    progress: Progress
    sampler: PairSampler
    model: RewardModel
    answered: AnsweredQueries
    desk: Desk
    so_far: AskingState
    asks: list[Asked] = field(default_factory=list)
    _may_be_left: bool = True

    # Whether to ask ------------------------------------------------------------------------------

    def postpone(self, step: int) -> None:
        """Ask nothing before that step."""
        self.so_far.next_step = step

    def remaining(self) -> int:
        """Answers the budget still wants."""
        return self.record.counted().remaining

    def is_left_open(self, step: int) -> bool:
        """Whether an earlier attempt opened the next session by this step: what is missing of it is nobody's to post.

        It is to be adopted before anything is waited for.
        """
        if not self._may_be_left:
            return False
        found = self.record.find(self.so_far.index)
        self._may_be_left = found is not None
        return found is not None and found.step <= step

    def can_draw(self) -> bool:
        """Whether there are two segments to ask about, now that it is time; the history tells the first time not."""
        if self.sampler.can_draw():
            return True
        if not self.so_far.told_shortage and (shortage := self.sampler.shortage()):
            self.so_far.told_shortage = True
            if self.remaining():
                self._tell(shortage)
        return False

    def _tell(self, shortage: str) -> None:
        text = (
            f"Nothing can be asked yet: {shortage}. Wait until episodes last longer,"
            " or start another run with a smaller feedback.segment_steps."
        )
        log.warning(text)
        self.record.note(text)

    def drew_nothing(self) -> bool:
        """Whether no pair could be drawn of the two sessions before the last: one clip may fail by itself."""
        earlier = [self.record.find(self.so_far.index - back) for back in (2, 3)]
        return all(found is not None and not found.asked for found in earlier)

    # Sessions ------------------------------------------------------------------------------------

    def open(self, training: Training, wanted: int) -> bool:
        """Ask up to `wanted` pairs in a new session, or what an earlier attempt left unposted of it.

        False when the budget allows none.

        The checkpoint comes first: an attempt that goes on from it draws the same pairs and finds the same rows.
        """
        self.so_far.index = self.record.first_to_ask(self.so_far.index)
        count = self.record.size(self.so_far.index, wanted)
        if not count:
            return False
        self.progress.phase(Phase.ASKING)
        training.upkeep.save(training)
        opened = self.record.open(
            self.so_far.index,
            step=training.step,
            asked=count,
            segment_return=self.sampler.average_return(),
        )
        chosen = self._choose(training, opened.asked)
        self.so_far.index += 1
        self.so_far.opened_step = training.step
        self._post(Asked(opened, dict(enumerate(chosen))))
        self.progress.listen()
        return True

    def _choose(self, training: Training, count: int) -> list[Chosen]:
        """Uniform until the first fit: the ensemble knows nothing yet (algorithm, section 5)."""
        scheme = self.config.scheme if training.fits else Uniform()
        asked = partial(self.answered.observations, training.config.catalogue_entry.observation_size)
        wanted = Selection(self.sampler, self.model, count, self.config.candidates_per_query, asked)
        return select(scheme, wanted)

    def _post(self, asked: Asked) -> None:
        """Post what is not posted yet of that session."""
        posted = self.record.posted(asked.session)
        missing = {index: chosen for index, chosen in asked.pairs.items() if index not in posted}
        self.asks = [*[a for a in self.asks if not self.desk.has_posted(a)], asked]
        self.desk.ask(Asked(asked.session, missing))

    def supersede(self) -> None:
        """Close what is still open: fresher pairs take its place, and it costs no budget."""
        self.desk.withdraw()
        self.asks = []
        self.record.supersede(before=self.so_far.index)

    # Standing still ------------------------------------------------------------------------------

    def news(self, step: int) -> Inbox:
        """The latest inbox; remembers when answers last came."""
        inbox = self._listen()
        if inbox.sequence != self.so_far.news_sequence:
            self.so_far.news_sequence, self.so_far.news_step = inbox.sequence, step
        return inbox

    def wait(self, training: Training, until: Callable[[Inbox], bool]) -> Inbox:
        """Say for how many answers training waits, and obey people meanwhile."""
        while not until(inbox := self._listen()):
            self.progress.phase(Phase.WAITING, RunState.WAITING, wanted_answers=inbox.open + inbox.rendering)
            training.upkeep.obey()
            time.sleep(0.05)
        return self.news(training.step)

    def _listen(self) -> Inbox:
        self.desk.check()
        return self.progress.check()

    def learned(self, cursor: int) -> None:
        """The answers up to the cursor have been learned from."""
        self.so_far.cursor = cursor

    # Checkpoints ---------------------------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        unposted = [asked for asked in self.asks if not self.desk.has_posted(asked)]
        return {**asdict(self.so_far), "asks": [state_of(asked) for asked in unposted]}

    def load(self, state: dict[str, Any]) -> None:
        """Go on from there: post again what had been asked and not yet posted."""
        asks = state.pop("asks")
        self.so_far = AskingState(**state)
        for asked in asks:
            self._ask_again(asked)

    def _ask_again(self, asked: dict[str, Any]) -> None:
        opened = self.record.numbered(asked["session"])
        pairs = pairs_from(asked["pairs"], self.sampler.pool, self.sampler.length)
        if pairs is not None:
            self._post(Asked(opened, pairs))
        else:
            self.record.trim(opened)
