"""An installation in the middle of its life: a run in every state, made through the record's own use cases."""

from __future__ import annotations

import math
import random
from collections.abc import Mapping
from datetime import timedelta
from uuid import uuid4

from sqlalchemy import select
from sqlalchemy.orm import Session

from labels_db.answers import answer_query
from labels_db.claims import Claim, Report, acknowledge_stop, beat, claim, fail_run, finish_run
from labels_db.commands import finish
from labels_db.data_folder import DataFolder
from labels_db.database import Database
from labels_db.feedback_sessions import open_session, post_query, session_queries
from labels_db.leases import labeller_named, lease_queries
from labels_db.models import Clip, Command, FeedbackSession, Phase, Pressed, Run, RunState, Segment, utc_now
from labels_db.overrides import with_settings
from labels_db.policy_commands import PolicyCommand, ask_of_policy
from labels_db.presets import preset_named
from labels_db.records import (
    FitReport,
    Measurement,
    record_checkpoint,
    record_evaluation,
    record_fit,
    record_metrics,
)
from labels_db.runs import note, pause_run, request_run
from labels_db.storage import ArtifactStore, sha256
from tests.web import pictures

WINDMILL = "cartpole-windmill-clockwise"


def queued(session: Session, preset: str, settings: Mapping[str, str] | None = None, title: str = "") -> Run:
    """A run that waits for its turn."""
    found = preset_named(preset)
    config = with_settings(found.config(), settings or {})
    return request_run(session, config, title=title or found.title, goal=found.goal, preset=preset)


def run_ids(session: Session) -> list[str]:
    return list(session.scalars(select(Run.id).order_by(Run.created_at)))


def started(session: Session, run: Run) -> Claim:
    return claim(session, run, "demo", now=utc_now())


def going(session: Session, held: Claim, **said: object) -> None:
    """The trainer's word on what it does."""
    report = {
        "state": RunState.RUNNING,
        "phase": Phase.TRAINING,
        "step": 12_400,
        "steps_per_second": 214.0,
        **said,
    }
    beat(session, held, Report(**report), now=utc_now())  # type: ignore[arg-type]


def segment(session: Session, store: ArtifactStore, run_id: str, number: int) -> Segment:
    """A segment with its clip, both in the store first."""
    speed, key = number % 6 / 2 - 1, f"runs/{run_id}/segments/{number}"
    data, picture = pictures.arrays(), pictures.sheet(speed, phase=number % 6)
    store.write(f"{key}.bin", data)
    made = Segment(
        run_id=run_id,
        episode=number,
        start=100,
        length=100,
        policy_step=8000,
        artifact_key=f"{key}.bin",
        checksum=sha256(data),
        true_return=speed,
        clip=Clip(
            artifact_key=f"{key}.webp",
            checksum=store.write(f"{key}.webp", picture),
            frames=pictures.FRAMES,
            rows=pictures.FRAMES // pictures.COLUMNS,
            columns=pictures.COLUMNS,
            width=pictures.WIDTH,
            height=pictures.HEIGHT,
            duration=1.0,
            times=[k / pictures.FRAMES for k in range(pictures.FRAMES)],
        ),
    )
    session.add(made)
    return made


def posted(
    session: Session, store: ArtifactStore, held: Claim, *, index: int, count: int, asked: int | None = None
) -> FeedbackSession:
    """A feedback session with that many pairs, of those asked, on the page."""
    opened = open_session(session, held, index=index, step=4000 + 2000 * index, asked=asked or count)
    for place in range(count):
        number = 100 * index + 2 * place
        pair = (
            segment(session, store, held.run_id, number),
            segment(session, store, held.run_id, number + 1),
        )
        post_query(session, held, opened, index=place, segments=pair, scheme="entropy", score=0.5)
    return opened


def answered(session: Session, run_id: str, count: int, name: str = "Ada") -> None:
    """So many open pairs answered by somebody who likes fast clockwise turns, more or less."""
    rng, person = random.Random(7), labeller_named(session, name)
    now = utc_now()
    for place in range(count):
        (lease,) = lease_queries(session, run_id, person.id, count=1, now=now, rng=rng)
        answer_query(
            session,
            lease.id,
            person.id,
            answer_id=str(uuid4()),
            pressed=(Pressed.LEFT, Pressed.RIGHT, Pressed.LEFT, Pressed.EQUAL, Pressed.SKIP)[place % 5],
            now=now - timedelta(seconds=3 * (count - place)),
        )


def curves(session: Session, held: Claim, until: int, best: float = 700) -> None:
    """Returns that rise, with noise, and a steady speed."""
    rng = random.Random(until)
    rows = [
        Measurement(step, "episode_return", best * _rise(step / until) + rng.gauss(0, best / 20))
        for step in range(1000, until + 1, 1000)
    ]
    rows += [
        Measurement(step, "steps_per_second", 210 + rng.gauss(0, 8) + (900 if step < 2000 else 0))
        for step in range(500, until + 1, 500)
    ]
    record_metrics(session, held, rows)


def _rise(share: float) -> float:
    return 1 / (1 + math.exp(-8 * (share - 0.5)))


def evaluated(session: Session, store: ArtifactStore, held: Claim, steps: range, best: float = 700) -> None:
    """Evaluations with a video each."""
    for step in steps:
        key = f"runs/{held.run_id}/videos/{step}.mp4"
        share = step / steps[-1]
        store.write(key, pictures.video(0.5 + round(2 * share)))
        record_evaluation(
            session,
            held,
            step=step,
            returns=[best * _rise(share)],
            measures={"turns": round(20 * share)},
            video_key=key,
        )


def fitted(session: Session, held: Claim, index: int, queries: Mapping[int, float]) -> None:
    share = (index + 1) / 6
    report = FitReport(
        preferences=10 * (index + 1),
        epochs=20 + index,
        training_accuracy=0.9 + 0.09 * share,
        fresh_accuracy=None if index == 0 else 0.55 + 0.4 * share,
    )
    record_fit(
        session,
        held,
        index=index,
        step=4000 + 2000 * index,
        cursor=10 * (index + 1),
        report=report,
        probabilities=queries,
    )


def saved(session: Session, held: Claim, step: int) -> None:
    """A checkpoint's row; nothing in a demonstration reads its files."""
    key = f"runs/{held.run_id}/checkpoints/{step}/manifest.json"
    record_checkpoint(session, held, step=step, manifest_key=key, checksum=sha256(b""))


def asked_of(session: Session, run_id: str, kind: PolicyCommand, **arguments: object) -> Command:
    return ask_of_policy(session, run_id, kind, asked_by="demo", **arguments)


def done(session: Session, command: Command, result: Mapping[str, object]) -> None:
    """The supervisor has taken the command, and this came of it."""
    command.taken_at = utc_now()
    finish(session, command.id, result)


def reevaluated(session: Session, command: Command, step: int) -> None:
    measures = {"largest_tilt": 4}
    result = {"step": step, "episodes": 10, "return": 812.34, "returns": [812.34], "measures": measures}
    done(session, command, result)


def exported(session: Session, store: ArtifactStore, command: Command, step: int) -> None:
    """The exported file holds the word "policy"."""
    form = command.arguments["format"]
    key = f"runs/{command.run_id}/exports/{command.id}/{command.run_id}-step-{step}.{form}"
    checksum = store.write(key, b"policy")
    done(session, command, {"artifact": key, "sha256": checksum, "step": step, "bytes": 271_402})


def populate(data: DataFolder, database: Database) -> dict[str, str]:
    """Every state a run can be in; returns run ids by state."""
    store = data.open_store()
    makers = (_finished, _failed, _stopped, _paused, _waiting, _teaching, _queued)
    ids: dict[str, str] = {}
    for make in makers:
        with database.write() as session:
            ids[make.__name__[1:]] = make(session, store)
    log = data.log_path(ids["failed"])
    log.parent.mkdir(parents=True, exist_ok=True)
    log.write_text(LOG, encoding="utf-8")
    data.log_path(ids["teaching"]).write_text(LOG.partition("Traceback")[0], encoding="utf-8")
    return ids


LOG = """\
10:02:11 attempt 1 starts: cart pole, clockwise windmill, seed 1
10:02:13 rendering with EGL
10:02:14 seeding: 1000 uniformly random steps
10:02:20 exploring: 3000 steps
10:02:41 session 1: 10 pairs asked
Traceback (most recent call last):
  File "trainer/training.py", line 88, in train
    reward.fit(preferences)
torch.cuda.OutOfMemoryError: CUDA out of memory. Tried to allocate 20.00 MiB
"""


def _queued(session: Session, _store: ArtifactStore) -> str:
    queued(session, "cartpole-swingup")
    return queued(session, "walker-walk", title="Walker, second try").id


def _teaching(session: Session, store: ArtifactStore) -> str:
    run = queued(session, WINDMILL, {"total_steps": "40000"})
    held = started(session, run)
    for index in range(3):
        opened = posted(session, store, held, index=index, count=4 if index < 2 else 6, asked=10)
        if index < 2:
            answered(session, run.id, 4)
            queries = {q.id: random.Random(q.id).random() for q in session_queries(session, opened.id)}
            fitted(session, held, index, queries)
    answered(session, run.id, 2, "Grace")
    curves(session, held, 12_000)
    evaluated(session, store, held, range(2000, 12_001, 2000))
    going(session, held, next_session_step=16_700)
    return run.id


def _waiting(session: Session, store: ArtifactStore) -> str:
    run = queued(session, "cartpole-windmill-counter-clockwise", {"feedback.pace": "block"})
    held = started(session, run)
    posted(session, store, held, index=0, count=6)
    going(session, held, state=RunState.WAITING, phase=Phase.WAITING, step=4000, wanted_answers=6)
    return run.id


def _paused(session: Session, _store: ArtifactStore) -> str:
    run = queued(session, "walker-walk", {"seed": "4"}, title="Walker at night")
    held = started(session, run)
    curves(session, held, 80_000, best=600)
    pause_run(session, run.id)
    going(session, held, state=RunState.PAUSED, step=82_000)
    return run.id


def _stopped(session: Session, _store: ArtifactStore) -> str:
    run = queued(session, "cartpole-swingup", {"seed": "2"})
    held = started(session, run)
    going(session, held)
    acknowledge_stop(session, held)
    return run.id


def _failed(session: Session, _store: ArtifactStore) -> str:
    run = queued(session, WINDMILL, {"seed": "3"}, title="Windmill on the graphics card")
    held = started(session, run)
    going(session, held, step=4000)
    saved(session, held, 4000)
    fail_run(session, held, "torch.cuda.OutOfMemoryError: CUDA out of memory. Tried to allocate 20.00 MiB")
    command = asked_of(session, run.id, "evaluate", episodes=10)
    done(session, command, {"error": "artifact weights: missing"})
    return run.id


def _finished(session: Session, store: ArtifactStore) -> str:
    run = queued(session, "cartpole-swingup", {"total_steps": "60000"})
    held = started(session, run)
    curves(session, held, 60_000, best=830)
    evaluated(session, store, held, range(5000, 60_001, 11_000), best=830)
    for index in range(5):
        fitted(session, held, index, {})
    note(session, run, "Reached a true return of 800 for the first time.")
    going(session, held, step=60_000)
    saved(session, held, 60_000)
    finish_run(session, held)
    reevaluated(session, asked_of(session, run.id, "evaluate", episodes=10), 60_000)
    exported(session, store, asked_of(session, run.id, "export-policy", format="onnx"), 60_000)
    asked_of(session, run.id, "export-policy", format="safetensors")
    return run.id
