"""Runs by name: in groups, told apart, the archived left out."""

from __future__ import annotations

from datetime import timedelta

from sqlalchemy import delete
from sqlalchemy.orm import Session

from labels_db.database import Database
from labels_db.experiments import request_experiment
from labels_db.models import ExperimentTitle, utc_now
from labels_db.presets import preset_named
from labels_db.run_names import runs_besides
from labels_db.runs import request_run
from tests.web import demo_experiment


def _asked(session: Session, run_id: str, title: str, *, minutes: int) -> None:
    config = preset_named("cartpole-swingup").config()
    run = request_run(session, config, title=title, goal="Up.", run_id=run_id)
    run.created_at = utc_now() + timedelta(minutes=minutes)


def test_runs_are_grouped_and_told_apart(database: Database) -> None:
    with database.write() as session:
        older = request_experiment(session, demo_experiment.experiment("older", seeds=1))
        newer = request_experiment(session, demo_experiment.experiment("newer", seeds=1))
        for run in newer:
            run.created_at += timedelta(minutes=1)
        session.execute(delete(ExperimentTitle).where(ExperimentTitle.experiment == "older"))
        _asked(session, "first", "Same", minutes=2)
        _asked(session, "second", "Same", minutes=3)
        _asked(session, "third", "Other", minutes=4)
        _asked(session, "gone", "Gone", minutes=5)
        session.flush()
        session.get_one(type(older[0]), "gone").archived = True
        left_out = [older[0].id, "first"]
        session.flush()
        single, new, old = runs_besides(session, left_out)
    assert (single.title, new.title, old.title) == (None, demo_experiment.TITLE, "older")
    assert [(run.id, run.name) for run in single.runs] == [("third", "Other"), ("second", "Same (second)")]
    assert [run.id for run in new.runs] == [run.id for run in newer]
    assert [run.id for run in old.runs] == [run.id for run in older[1:]]
    assert (
        new.runs[0].name == f"{newer[0].title} ({newer[0].id})"
    )  # the older experiment has one of that title


def test_an_experiment_all_of_whose_runs_are_left_out_is_no_group(database: Database) -> None:
    with database.write() as session:
        runs = request_experiment(session, demo_experiment.experiment(seeds=1))
        session.flush()
        assert runs_besides(session, [run.id for run in runs]) == []
