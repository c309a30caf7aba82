"""An experiment in the middle of its life, made through the record's own use cases."""

from __future__ import annotations

import math
import random

from sqlalchemy.orm import Session

from labels_db.claims import Claim, fail_run, finish_run
from labels_db.experiments import Compared, Experiment, request_experiment
from labels_db.feedback_sessions import open_session, post_query
from labels_db.models import Run, RunState
from labels_db.records import record_evaluation
from tests.labels_db.given import a_segment
from tests.web import demo

NAME, TITLE = "few-labels", "Few labels"
BEST = {"pebble": 820.0, "preference-ppo": 410.0, "sac": 900.0}
TASKS = ("cartpole-swingup", "walker-walk")
STEPS = 50_000


def experiment(name: str = NAME, *, seeds: int = 3, budget: int = 60) -> Experiment:
    """Three methods on two tasks; sac is asked nothing."""
    asked = {"feedback.teacher.kind": "oracle", "feedback.budget": budget}
    return Experiment(
        name=name,
        title=TITLE,
        tasks=list(TASKS),
        methods=[Compared(method=m, name=m, settings={} if m == "sac" else asked) for m in BEST],
        seeds=list(range(1, seeds + 1)),
        settings={"total_steps": STEPS, "evaluation.every": 5000},
    )


def populate(session: Session) -> list[str]:
    """Two seeds finished, of the third one failed, two under way, the others queued; returns the runs' ids."""
    runs = request_experiment(session, experiment())
    for run in runs:
        make = _ended if run.config["seed"] < 3 else THIRD_SEEDS.get(run.id.removeprefix(f"{NAME}-"))
        if make:
            make(session, run)
    return [run.id for run in runs]


def _ended(session: Session, run: Run) -> None:
    held = demo.started(session, run)
    lived(session, run, held, until=STEPS)
    demo.going(session, held, step=STEPS)
    finish_run(session, held)


def _under_way(session: Session, run: Run) -> None:
    held = demo.started(session, run)
    lived(session, run, held, until=STEPS // 2)
    demo.going(session, held, step=STEPS // 2 + 400)


def _failed(session: Session, run: Run) -> None:
    held = demo.started(session, run)
    demo.going(session, held, state=RunState.RUNNING, step=900)
    fail_run(session, held, "the simulator diverged")


THIRD_SEEDS = {
    "cartpole-swingup-pebble-3": _under_way,
    "walker-walk-pebble-3": _under_way,
    "cartpole-swingup-preference-ppo-3": _failed,
}


def lived(session: Session, run: Run, held: Claim, *, until: int, every: int = 5000) -> None:
    """What a scripted teacher was asked, and evaluations that rise."""
    if run.method != "sac":
        asked(session, held, 60 if until == STEPS else 30)
    for step in range(every, until + 1, every):
        evaluated(session, run, held, step)


def asked(session: Session, held: Claim, count: int) -> None:
    opened = open_session(session, held, index=0, step=1000, asked=count)
    for index in range(count):
        pair = (a_segment(held.run_id, 2 * index), a_segment(held.run_id, 2 * index + 1))
        post_query(session, held, opened, index=index, segments=pair, scheme="uniform", score=None)


def evaluated(session: Session, run: Run, held: Claim, step: int) -> None:
    """Better with every step, worse with every seed, and never quite the same."""
    noise = random.Random(f"{run.id} {step}").gauss(0, 0.04)
    risen = 1 / (1 + math.exp(-9 * (step / STEPS - 0.4))) + noise - 0.05 * run.config["seed"]
    measures = {"success": round(min(1.0, max(0.0, risen)), 2)} if run.preset == TASKS[0] else {}
    returns = [BEST[run.method or ""] * risen]
    record_evaluation(session, held, step=step, returns=returns, measures=measures, video_key=None)
