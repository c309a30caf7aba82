"""When sessions open, are adopted and learned from: the rules on a real record, with pairs that need no simulator."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np
import pytest
from sqlalchemy import select

from labels_db.claims import Claim
from labels_db.database import Database
from labels_db.feedback_progress import Inbox, read_inbox
from labels_db.feedback_sessions import find_session, open_session, post_query, trim_session
from labels_db.models import Event, FeedbackSession, Query, utc_now
from tests.labels_db import given
from tests.trainer.conftest import RUN, Lab, small_config
from trainer.asking import Asker
from trainer.asking_rules import rule_and_pace
from trainer.asking_state import AskingState
from trainer.episodes import EpisodePool, FinishedEpisode
from trainer.feedback import FromTeacher
from trainer.posting import Asked
from trainer.query_selection import Chosen
from trainer.segments import PairSampler
from trainer.session_record import SessionRecord

FIRST = 300
"""The step after exploration."""


@dataclass
class PostingDesk:
    """Posts at once, as a person's desk does in the end; or can draw nothing."""

    database: Database
    claim: Claim
    draws: bool = True

    def ask(self, asked: Asked) -> None:
        with self.database.write() as session:
            post(session, self.claim, asked.session, list(asked.pairs) if self.draws else [])
            if not self.draws:
                trim_session(session, self.claim, asked.session.id)

    def has_posted(self, _asked: Asked) -> bool:
        return True

    def withdraw(self) -> None: ...

    def check(self) -> None: ...

    def close(self) -> None: ...


@dataclass
class Listening:
    """Reads the inbox whenever it is asked; the person answers while training waits."""

    database: Database
    said: list[str] = field(default_factory=list)

    def check(self) -> Inbox:
        with self.database.read() as session:
            return read_inbox(session, RUN)

    listen = check

    def phase(self, phase: str, *_state: Any, **_more: Any) -> None:
        self.said.append(phase)


def post(session: Any, claim: Claim, opened: FeedbackSession, places: list[int]) -> None:
    for index in places:
        segments = given.a_segment(RUN, 2 * index), given.a_segment(RUN, 2 * index + 1)
        post_query(session, claim, opened, index=index, segments=segments, scheme="uniform", score=None)


def answer_everything(database: Database) -> None:
    with database.write() as session:
        for lease in given.leases(session, given.labeller(session), 99, at=utc_now(), run_id=RUN):
            given.an_answer(session, lease, f"a-{lease.id}", at=utc_now())


@dataclass
class AtStep:
    """As much of a training as its feedback looks at; while it waits, people answer everything, three times at most."""

    database: Database
    step: int = 0
    fits: int = 0
    waits: int = 0

    @property
    def upkeep(self) -> AtStep:
        return self

    def save(self, _training: Any) -> None: ...

    def obey(self) -> None:
        self.waits += 1
        assert self.waits <= 3, "it waits for ever"
        answer_everything(self.database)


@dataclass
class Asking:
    """The feedback of a claimed run, asked at any step."""

    feedback: FromTeacher
    training: AtStep

    @property
    def asker(self) -> Asker:
        return self.feedback.asker

    def before_step(self, step: int) -> int | None:
        self.training.step = step
        return self.feedback.before_step(cast("Any", self.training))


def feedback(lab: Lab, *, draws: bool = True, lengths: Sequence[int] = (999, 999), **settings: Any) -> Asking:
    """The configured rule and pace of a claimed run whose pool has episodes of those lengths."""
    config = small_config(feedback__teacher__kind="human", **settings)
    lab.request(config)
    claim = lab.claim()
    nothing: Any = None  # no model chooses here, and no answer is read
    asker = Asker(
        config=cast("Any", config.feedback),
        record=SessionRecord(lab.database, claim),
        progress=cast("Any", Listening(lab.database)),
        sampler=PairSampler(pool(lengths), config.segment_steps, np.random.default_rng(1)),
        model=nothing,
        answered=nothing,
        desk=PostingDesk(lab.database, claim, draws),
        so_far=AskingState.at_first(config.exploration.ends_at),
    )
    anything = Chosen(nothing, "uniform", None)
    vars(asker)["_choose"] = lambda _training, count: [anything] * count
    rule, pace = rule_and_pace(asker.config, config.total_steps)
    return Asking(FromTeacher(asker, rule, pace, config.total_steps), AtStep(lab.database))


def pool(lengths: Sequence[int]) -> EpisodePool:
    made = EpisodePool(20)
    for number, steps in enumerate(lengths):
        nothing = np.zeros((steps, 1))
        made.add(FinishedEpisode(number, number, 0, nothing, nothing, np.zeros(steps), nothing))
    return made


def told(lab: Lab) -> list[str]:
    """What the history says of asking."""
    with lab.database.read() as session:
        texts = session.scalars(select(Event.text)).all()
    return [text for text in texts if "asked yet" in text]


def sessions(lab: Lab) -> list[tuple[int, int, int]]:
    """Of each session its index, its step and how many queries were posted."""
    with lab.database.read() as session:
        opened = session.scalars(select(FeedbackSession).order_by(FeedbackSession.index)).all()
        posted = [query.session_id for query in session.scalars(select(Query)).all()]
    return [(found.index, found.step, posted.count(found.id)) for found in opened]


@pytest.mark.parametrize("pace", ["block", "stream"])
def test_what_an_earlier_attempt_left_unposted_is_posted_before_anything_is_waited_for(
    lab: Lab, pace: str
) -> None:
    """It died while it posted: 1 of 4 is there and open, and the budget is larger than the sessions left can hold."""
    asking = feedback(lab, feedback__pace=pace, feedback__budget=100)
    with lab.database.write() as session:
        claim = asking.asker.record.claim
        post(session, claim, open_session(session, claim, index=0, step=FIRST, asked=4), [0])
    asking.before_step(FIRST)
    assert sessions(lab) == [(0, FIRST, 4)]


def test_queries_always_ready_adopt_what_was_left_at_once(lab: Lab) -> None:
    asking = feedback(lab, feedback__kind="continuous", feedback__ready=3)
    with lab.database.write() as session:
        open_session(session, asking.asker.record.claim, index=0, step=FIRST, asked=3)
    asking.before_step(FIRST)
    assert sessions(lab) == [(0, FIRST, 3)]


def test_what_was_waited_for_is_learned_from_before_the_next_session_is_chosen(lab: Lab) -> None:
    asking = feedback(lab, feedback__pace="stream", feedback__budget=100, feedback__patience_steps=10_000)
    assert asking.before_step(FIRST) is None
    second = FIRST + 150
    assert asking.before_step(second) == 4
    assert len(sessions(lab)) == 1
    asking.feedback.learned(4)
    assert asking.before_step(second) is None
    assert sessions(lab)[1] == (1, second, 4)


def test_a_session_of_which_nothing_could_be_drawn_is_stepped_over(lab: Lab) -> None:
    asking = feedback(lab, feedback__pace="stream")
    with lab.database.write() as session:
        claim = asking.asker.record.claim
        trim_session(session, claim, open_session(session, claim, index=0, step=FIRST, asked=4).id)
    asking.before_step(FIRST)
    assert sessions(lab) == [(0, FIRST, 0), (1, FIRST, 4)]


def test_one_pair_that_cannot_be_drawn_does_not_silence_it(lab: Lab) -> None:
    asking = feedback(lab, draws=False, feedback__kind="continuous", feedback__fresh_steps=500)
    asking.before_step(FIRST)
    vars(asking.asker.desk)["draws"] = True
    for step in range(FIRST + 1, FIRST + 20):
        asking.before_step(step)
        answer_everything(lab.database)
    assert sum(posted for _, _, posted in sessions(lab)) == 12  # the budget


def test_where_nothing_can_be_drawn_it_is_tried_seldom(lab: Lab) -> None:
    asking = feedback(lab, draws=False, feedback__kind="continuous", feedback__fresh_steps=500)
    for step in range(FIRST, FIRST + 600):
        asking.before_step(step)
    assert [step for _, step, _ in sessions(lab)] == [FIRST, FIRST + 1, FIRST + 2, FIRST + 502]
    with lab.database.read() as session:
        last = find_session(session, RUN, 3)
        assert last is not None
        assert last.asked == 0


KINDS = pytest.mark.parametrize("kind", ["sessions", "continuous"])
H: dict[str, Any] = {"feedback__segment_steps": 125}


@KINDS
def test_that_episodes_are_too_short_to_ask_about_is_told_once(lab: Lab, kind: str) -> None:
    asking = feedback(lab, lengths=[9, 20, 130, 30], feedback__kind=kind, **H)
    asking.before_step(FIRST - 1)
    assert told(lab) == []  # nothing was due
    for step in range(FIRST, FIRST + 3):
        asking.before_step(step)
    asking.feedback.load(asking.feedback.state())
    asking.before_step(FIRST + 4)
    assert told(lab) == [
        "Nothing can be asked yet: two segments of 125 steps cannot be cut from the last 4 episodes, of which half"
        " have at most 20 steps and the longest has 130. Wait until episodes last longer, or start another run with"
        " a smaller feedback.segment_steps."
    ]
    assert sessions(lab) == []


@KINDS
@pytest.mark.parametrize("lengths", [[], [125], [9, 125, 125]])
def test_it_is_not_told_before_episodes_are_over_or_where_some_are_long_enough(
    lab: Lab, kind: str, lengths: list[int]
) -> None:
    asking = feedback(lab, lengths=lengths, feedback__kind=kind, **H)
    asking.before_step(FIRST)
    assert told(lab) == []
    assert bool(sessions(lab)) == (len(lengths) > 2)


@KINDS
def test_it_is_not_told_where_nothing_is_to_be_asked_any_more(lab: Lab, kind: str) -> None:
    asking = feedback(lab, lengths=[9, 9], feedback__kind=kind, **H)
    vars(asking.asker)["remaining"] = lambda: 0
    asking.before_step(FIRST)
    assert told(lab) == []
