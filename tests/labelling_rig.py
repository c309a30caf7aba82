"""A run with people whose clips are drawn here: small windmills, so that no simulator is needed."""

from __future__ import annotations

import functools
import io
import math
import random
from dataclasses import dataclass, field

from PIL import Image, ImageDraw

from labels_db.database import Database
from labels_db.models import Answer, Clip, FeedbackSession, Lease, Query, RunState, Segment, utc_now
from labels_db.presets import preset_named
from labels_db.queries import answers_since, labeller_named, lease_queries, open_session, post_query
from labels_db.records import attach_video, record_evaluation
from labels_db.runs import Claim, Report, beat, claim, finish_run, get_run, request_run
from labels_db.storage import ArtifactStore

FRAMES, COLUMNS, WIDTH, HEIGHT = 25, 5, 320, 240
SPEEDS = (0.4, 1.0, 1.7, 2.4)
GOAL = "Prefer the clip in which the pole turns clockwise, faster and more evenly."


def frame(angle: float) -> Image.Image:
    """One picture of a pole on a cart, `angle` radians clockwise from upright."""
    image = Image.new("RGB", (WIDTH, HEIGHT), "#dfe6ee")
    draw = ImageDraw.Draw(image)
    draw.rectangle((0, 160, WIDTH, HEIGHT), fill="#b9c4cf")
    draw.rectangle((130, 110, 190, 130), fill="#3b4b5c")
    tip = (160 + 80 * math.sin(angle), 120 - 80 * math.cos(angle))
    draw.line(((160, 120), tip), fill="#c2703d", width=9)
    draw.ellipse((tip[0] - 9, tip[1] - 9, tip[0] + 9, tip[1] + 9), fill="#8c4a20")
    return image


@functools.cache
def sheet(speed: float) -> bytes:
    """A second of turning at so many turns a second, as a sprite sheet."""
    image = Image.new("RGB", (COLUMNS * WIDTH, math.ceil(FRAMES / COLUMNS) * HEIGHT))
    for index in range(FRAMES):
        turned = frame(2 * math.pi * (speed * index / FRAMES + 0.1 * speed))
        image.paste(turned, (index % COLUMNS * WIDTH, index // COLUMNS * HEIGHT))
    buffer = io.BytesIO()
    image.save(buffer, "WEBP", quality=70, method=0)
    return buffer.getvalue()


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
        report = Report(state, "training", step, 100.0, wanted_answers, next_session_step, utc_now())
        with self.database.write() as session:
            beat(session, self.owner, report, now=utc_now())

    def finish(self) -> None:
        with self.database.write() as session:
            finish_run(session, self.owner)

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
            rows=math.ceil(FRAMES / COLUMNS),
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

    def film(self, step: int, video: bytes) -> None:
        """An evaluation with its video."""
        key = f"runs/{self.run_id}/videos/{step}.mp4"
        self.store.write(key, video)
        with self.database.write() as session:
            record_evaluation(session, self.owner, step=step, returns=[3.125], measures={}, video_key=None)
            attach_video(session, self.owner, step=step, video_key=key)

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

    def leases(self) -> list[Lease]:
        """All leases ever granted, with their queries, oldest first."""
        with self.database.read() as session:
            found = list(session.query(Lease).order_by(Lease.id))
            for lease in found:
                _ = lease.query.index
            return found

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
