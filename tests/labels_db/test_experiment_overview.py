"""How far an experiment's runs have come and its results, from runs in every state."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from sqlalchemy.orm import Session

from labels_db.database import Database
from labels_db.errors import NotFoundError
from labels_db.experiment_overview import (
    ExperimentOverview,
    Result,
    RunTally,
    experiment_overview,
    experiments,
)
from labels_db.experiments import request_experiment
from labels_db.feedback_progress import feedback_progress, feedback_progress_of
from labels_db.models import ExperimentTitle, Run
from labels_db.overview import chosen_overviews, experiment_overviews, overviews, single_overviews
from labels_db.runs import stop_run
from tests.labels_db import given
from tests.web import demo_experiment
from tests.web.demo_experiment import NAME, TASKS, TITLE


@pytest.fixture
def session(database: Database) -> Iterator[Session]:
    """An experiment half done, and a run that belongs to none."""
    with database.write() as session:
        demo_experiment.populate(session)
        given.a_run(session)
        session.flush()
        yield session


def result(shown: ExperimentOverview, task: str, method: str, measure: str = "return") -> Result:
    (found,) = [each for each in shown.results(measure) if (each.task, each.method) == (task, method)]
    return found


def test_runs_are_single_or_an_experiments(session: Session) -> None:
    assert [seen.run.id for seen in single_overviews(session)] == ["mill"]
    own = experiment_overviews(session, NAME)
    assert len(own) == 18
    assert {seen.run.id for seen in overviews(session)} == {"mill", *(seen.run.id for seen in own)}


def test_every_experiment_says_how_it_stands_and_what_of(session: Session) -> None:
    request_experiment(session, demo_experiment.experiment("later", seeds=1))
    stop_run(session, "later-walker-walk-sac-1")
    later, first = experiments(session)
    assert (first.name, later.name) == (NAME, "later")
    assert first.title == TITLE
    assert first.tally == RunTally(finished=12, going=2, queued=3, failed=1, stopped=0)
    assert (first.tally.runs, later.tally.stopped, later.tally.queued) == (18, 1, 5)
    assert (first.tasks, first.methods) == (list(TASKS), ["pebble", "preference-ppo", "sac"])
    assert experiment_overview(session, NAME).summary == first


def test_a_changed_title_is_the_one_that_counts(session: Session) -> None:
    renamed = demo_experiment.experiment().model_copy(update={"title": "Few answers"})
    request_experiment(session, renamed)
    assert experiment_overview(session, NAME).summary.title == "Few answers"


def test_an_experiment_of_before_titles_were_kept_goes_by_its_name(session: Session) -> None:
    session.delete(session.get_one(ExperimentTitle, NAME))
    session.flush()
    assert experiment_overview(session, NAME).summary.title == NAME


def test_archived_runs_are_left_out(session: Session) -> None:
    for run in session.query(Run).where(Run.experiment == NAME):
        run.archived = True
    assert experiments(session) == []
    with pytest.raises(NotFoundError, match="few-labels"):
        experiment_overview(session, NAME)


def test_results_are_of_the_last_evaluations(session: Session) -> None:
    shown = experiment_overview(session, NAME)
    assert shown.measures == ["return", "success"]
    found = result(shown, TASKS[0], "pebble")
    last = [shown.last[f"{NAME}-{TASKS[0]}-pebble-{seed}"].mean_return for seed in (1, 2)]
    assert found.last is not None
    assert found.last.mean == pytest.approx(sum(last) / 2)  # the third is still at it
    assert (found.last.count, found.tally.finished, found.tally.going) == (2, 2, 1)
    assert found.answers == 60
    assert result(shown, TASKS[0], "sac").answers == 0


def test_a_measure_that_a_task_has_not_leaves_its_results_empty(session: Session) -> None:
    shown = experiment_overview(session, NAME)
    assert result(shown, TASKS[0], "sac", "success").last is not None
    assert result(shown, TASKS[1], "sac", "success").last is None


def test_an_experiment_that_has_not_begun_has_no_results_yet(database: Database) -> None:
    with database.write() as session:
        request_experiment(session, demo_experiment.experiment(seeds=1))
        shown = experiment_overview(session, NAME)
        assert (shown.measures, shown.evaluated_at) == (["return"], "")
        assert {(each.last, each.answers) for each in shown.results("return")} == {(None, None)}


def test_counting_many_runs_at_once_is_counting_each(session: Session) -> None:
    found = session.query(Run).all()
    assert feedback_progress_of(session, found) == {run.id: feedback_progress(session, run) for run in found}


def test_chosen_runs_come_in_the_order_asked_for(session: Session) -> None:
    ids = ["mill", f"{NAME}-{TASKS[0]}-sac-1"]
    assert [seen.run.id for seen in chosen_overviews(session, ids)] == ids
    with pytest.raises(NotFoundError, match="nobody"):
        chosen_overviews(session, ["mill", "nobody"])
