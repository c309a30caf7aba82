"""A run with people, as its trainer leaves it in the record: drawn clips, queries, heartbeats."""

from __future__ import annotations

import functools
import random
from dataclasses import dataclass, field

from labels_db.answers import answer_query, answers_since
from labels_db.claims import Claim, Report, beat, claim, finish_run
from labels_db.database import Database
from labels_db.feedback_sessions import open_session, post_query, supersede_queries
from labels_db.leases import labeller_named, lease_queries
from labels_db.models import (
    Answer,
    Clip,
    FeedbackSession,
    Lease,
    Phase,
    Pressed,
    Query,
    RunState,
    Segment,
    utc_now,
)
from labels_db.presets import preset_named
from labels_db.records import attach_video, record_evaluation
from labels_db.runs import get_run, request_run
from labels_db.storage import ArtifactStore
from tests.web import pictures
from tests.web.pictures import COLUMNS, FRAMES, HEIGHT, WIDTH

SPEEDS = (0.4, 1.0, 1.7, 2.4)
GOAL = "Prefer the clip in which the pole turns clockwise, faster and more evenly."


sheet = functools.cache(pictures.sheet)
video = functools.cache(pictures.video)


def has_true_return(text: str) -> bool:
    """Whether a payload or page tells a labeller what a segment is worth; the rig's returns end in .125."""
    return "true_return" in text or ".125" in text


@dataclass
class LabelRun:
    """A claimed run, and what its trainer would do."""

    database: Database
    store: ArtifactStore
    run_id: str = "mill"
    posted: int = 0
    claimed: Claim | None = None
    rng: random.Random = field(default_factory=lambda: random.Random(7))

    def begin(self, *, asked: int = 50) -> LabelRun:
        """Claim the run and open its first session."""
        config = preset_named("cartpole-windmill-clockwise").config()
        with self.database.write() as session:
            run = request_run(
                session, config, title="Cart pole · clockwise windmill", goal=GOAL, run_id=self.run_id
            )
            self.claimed = claim(session, run, "rig", now=utc_now())
            open_session(session, self.claimed, index=0, step=4000, asked=asked)
        self.says(step=4000)
        return self

    @property
    def owner(self) -> Claim:
        assert self.claimed is not None, "begin first"
        return self.claimed

    def says(
        self,
        state: RunState = RunState.RUNNING,
        *,
        step: int = 5000,
        next_session_step: int | None = None,
        wanted_answers: int = 0,
    ) -> None:
        """A heartbeat, at 100 steps a second."""
        report = Report(state, Phase.TRAINING, step, 100.0, wanted_answers, next_session_step, utc_now())
        with self.database.write() as session:
            beat(session, self.owner, report, now=utc_now())

    def finish(self) -> None:
        with self.database.write() as session:
            finish_run(session, self.owner)

    def supersede(self) -> None:
        """Close whatever is open, as before a run's end."""
        with self.database.write() as session:
            supersede_queries(session, self.owner)

    def forget_leases(self) -> None:
        """As if every lease had lapsed."""
        with self.database.write() as session:
            for lease in session.query(Lease):
                lease.expires_at = utc_now()

    def post(self, count: int = 1, *, answers_needed: int = 1) -> None:
        """Ask that many pairs, their clips written before."""
        for index in range(self.posted, self.posted + count):
            speeds = self.rng.sample(SPEEDS, 2)
            segments = (self._segment(2 * index, speeds[0]), self._segment(2 * index + 1, speeds[1]))
            with self.database.write() as session:
                opened = session.get_one(FeedbackSession, 1)
                post_query(
                    session,
                    self.owner,
                    opened,
                    index=index,
                    segments=segments,
                    scheme="uniform",
                    score=None,
                    answers_needed=answers_needed,
                )
        self.posted += count

    def _segment(self, number: int, speed: float) -> Segment:
        key = f"runs/{self.run_id}/clips/{number}.webp"
        checksum = self.store.write(key, sheet(speed))
        clip = Clip(
            artifact_key=key,
            checksum=checksum,
            frames=FRAMES,
            rows=FRAMES // COLUMNS,
            columns=COLUMNS,
            width=WIDTH,
            height=HEIGHT,
            duration=1.0,
            times=[index / FRAMES for index in range(FRAMES)],
        )
        return Segment(
            run_id=self.run_id,
            episode=number,
            start=0,
            length=100,
            policy_step=4000,
            artifact_key=f"runs/{self.run_id}/segments/{number}",
            checksum="",
            true_return=number + 0.125,
            clip=clip,
        )

    def close_session(self) -> None:
        """No more pairs are to come: what was posted is what was asked."""
        with self.database.write() as session:
            session.get_one(FeedbackSession, 1).asked = self.posted

    def film(self, step: int, speed: float = 1.0) -> None:
        """An evaluation with its video."""
        key = f"runs/{self.run_id}/videos/{step}.mp4"
        self.store.write(key, video(speed))
        with self.database.write() as session:
            record_evaluation(session, self.owner, step=step, returns=[3.125], measures={}, video_key=None)
            attach_video(session, self.owner, step=step, video_key=key)

    def lose_clip_of(self, query_index: int) -> None:
        """The store loses what the query's second segment looks like."""
        with self.database.read() as session:
            query = session.query(Query).filter_by(run_id=self.run_id, index=query_index).one()
            assert query.second.clip is not None
            self.store.delete(query.second.clip.artifact_key)

    def archive(self) -> None:
        with self.database.write() as session:
            get_run(session, self.run_id).archived = True

    # What the record says ------------------------------------------------------------------------

    def answers(self) -> list[Answer]:
        """All answers and retractions, in order."""
        with self.database.read() as session:
            return list(answers_since(session, self.run_id, 0))

    def standing(self) -> dict[int, str]:
        """The choice that stands for each query, by its index."""
        answers = self.answers()
        retracted = {answer.retracts for answer in answers}
        return {
            answer.query.index: answer.choice.value
            for answer in answers
            if answer.choice is not None and answer.id not in retracted
        }

    def states(self) -> list[str]:
        """Each query's state, by its index."""
        with self.database.read() as session:
            return [query.state.value for query in session.query(Query).order_by(Query.index)]

    def leases(self) -> list[Lease]:
        """All leases ever granted, with their queries, oldest first."""
        with self.database.read() as session:
            found = list(session.query(Lease).order_by(Lease.id))
            for lease in found:
                _ = lease.query.index
            return found

    def answer_all_as(self, name: str, *, but: int = 0) -> None:
        """Somebody of that name prefers the left clip of every pair but the last ones."""
        lent = self.lend_to(name, count=self.posted - but)
        with self.database.write() as session:
            for lease in lent:
                answer_query(
                    session,
                    lease.id,
                    lease.labeller_id,
                    answer_id=f"{name}-{lease.id}",
                    pressed=Pressed.LEFT,
                    now=utc_now(),
                )

    def swap(self, query_index: int, *, swapped: bool) -> None:
        """Have the sides of a leased query be as a test needs them."""
        with self.database.write() as session:
            query = session.query(Query).filter_by(run_id=self.run_id, index=query_index).one()
            for lease in session.query(Lease).filter_by(query_id=query.id):
                lease.swapped = swapped

    def lend_to(self, name: str, *, count: int = 1, swapped: bool | None = None) -> list[Lease]:
        """Lease as a person of that name, sides as told."""
        with self.database.write() as session:
            person = labeller_named(session, name)
            found = lease_queries(session, self.run_id, person.id, count=count, now=utc_now(), rng=self.rng)
            for lease in found:
                lease.swapped = lease.swapped if swapped is None else swapped
            return found
