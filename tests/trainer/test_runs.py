"""Whole small runs: what they record, that they go on exactly after any end, that they repeat."""

from __future__ import annotations

import dataclasses
import os
import signal
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import select

from labels_db import catalogue
from labels_db.claims import Claim, attempt_died
from labels_db.models import (
    Choice,
    Event,
    FeedbackSession,
    Metric,
    Query,
    QueryState,
    RunState,
)
from labels_db.records import evaluations_of, fits_of
from labels_db.run_config import run as run_config
from labels_db.runs import extend_run, get_run, resume_run
from tests.trainer.conftest import RUN, Lab, new_lab, small_config
from tests.trainer.people import Person
from tests.trainer.whole_runs import (
    die_after_checkpoints,
    goes_on_exactly,
    kill_and_go_on,
    live_until,
    rows,
    weights,
)
from trainer import precision
from trainer.attempt import Attempt
from trainer.reward_model import RewardModel


def test_a_scripted_run_spends_its_budget_and_says_what_it_learned(undisturbed: Lab) -> None:
    with undisturbed.database.read() as session:
        run, fits = get_run(session, RUN), fits_of(session, RUN)
        assert (run.state, run.step, run.answer_sequence) == (RunState.FINISHED, 900, 12)
        assert [(f.step, f.cursor) for f in fits] == [(300, 4), (450, 8), (600, 12)]
        assert [q.scheme for q in session.scalars(select(Query))] == ["uniform"] * 4 + ["entropy"] * 8
        assert all(q.state is QueryState.CLOSED for q in session.scalars(select(Query)))
        assert [e.step for e in evaluations_of(session, RUN)] == [400, 800, 900]
        names = {m.name for m in session.scalars(select(Metric))}
    assert {"episode_return", "critic_loss", "actor_loss", "temperature", "entropy"} <= names
    assert list(undisturbed.data.events_path(RUN).iterdir()), "TensorBoard event files"


def test_every_session_knows_what_a_segment_earned_lately(undisturbed: Lab) -> None:
    """H steps of the episodes finished by then, which scripted teachers hold their thresholds against."""
    with undisturbed.database.read() as session:
        returns = session.execute(
            select(Metric.step, Metric.value).where(Metric.name == "episode_return")
        ).all()
        sessions = session.scalars(select(FeedbackSession)).all()
    assert len({one.segment_return for one in sessions}) == 3
    for one in sessions:
        finished = [value for step, value in returns if step <= one.step]
        share = small_config().segment_steps / 125
        assert one.segment_return == pytest.approx(share * sum(finished) / len(finished), rel=1e-4)


def die_in_the_first_fit(path: Path, run_id: str, attempt: int) -> None:
    """Live the run in this process, and be killed between posting and fit."""

    def dying_fit(*_: object, **__: object) -> None:
        os.kill(os.getpid(), signal.SIGKILL)

    RewardModel.fit = dying_fit  # type: ignore[method-assign, assignment]
    lab = new_lab(path)
    Attempt(lab.data, Claim(run_id, attempt)).live()


def test_killed_between_posting_and_fit_it_ends_with_the_same_rows_and_weights(
    lab: Lab, undisturbed: Lab
) -> None:
    lab.request(small_config())
    kill_and_go_on(lab, die_in_the_first_fit)
    assert rows(lab) == rows(undisturbed)
    assert weights(lab) == weights(undisturbed)


@pytest.mark.parametrize("count", [2, 5])
def test_killed_after_any_checkpoint_it_ends_with_the_same_rows_and_weights(
    lab: Lab, undisturbed: Lab, count: int
) -> None:
    lab.request(small_config())
    kill_and_go_on(lab, die_after_checkpoints, count)
    assert rows(lab) == rows(undisturbed)
    assert weights(lab) == weights(undisturbed)


def test_stopped_and_resumed_it_ends_with_the_same_rows_and_weights(lab: Lab, undisturbed: Lab) -> None:
    lab.request(small_config())
    assert live_until(lab, 520) is RunState.STOPPED
    with lab.database.write() as session:
        assert get_run(session, RUN).step == 520
        resume_run(session, RUN)
    assert lab.live() is RunState.FINISHED
    assert rows(lab) == rows(undisturbed)
    assert weights(lab) == weights(undisturbed)


def test_stopped_while_exploring_it_goes_on_exactly(tmp_path: Path) -> None:
    """What it knew of its states' neighbours is not kept: they are searched anew, to the bit."""
    goes_on_exactly(small_config(), tmp_path, 220)


def test_with_rounded_products_it_goes_on_exactly_and_differs_from_exact_ones(
    tmp_path: Path, undisturbed: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(precision, "WORTH_ROUNDING", 1)
    monkeypatch.setattr(precision, "fast_in_bfloat16", lambda _: True)
    end = goes_on_exactly(small_config(precision="auto"), tmp_path, 600)
    assert end.weights != weights(undisturbed)


def test_equal_seeds_give_equal_runs_and_other_seeds_others(lab: Lab, undisturbed: Lab) -> None:
    lab.request(small_config(seed=2))
    lab.live()
    assert weights(lab) != weights(undisturbed)


def test_an_attempt_that_has_lost_its_run_leaves_it_in_no_state(lab: Lab) -> None:
    lab.request(small_config())
    lost = lab.claim()
    with lab.database.write() as session:
        attempt_died(session, lost, "silent for too long")
    assert Attempt(lab.data, lost).live() is None
    with lab.database.read() as session:
        assert get_run(session, RUN).state is RunState.QUEUED


# What a run is asked for --------------------------------------------------------------------------


def test_a_living_run_that_is_extended_goes_on_to_the_new_end(lab: Lab) -> None:
    lab.request(small_config())
    attempt = Attempt(lab.data, lab.claim())
    with lab.database.write() as session:
        extend_run(session, RUN, total_steps=1000, budget=None)
    attempt_config = attempt._config
    configs = iter([small_config()])
    attempt._config = lambda: next(configs, None) or attempt_config()  # type: ignore[method-assign]
    assert attempt.live() is RunState.QUEUED
    assert lab.live() is RunState.FINISHED
    with lab.database.read() as session:
        assert get_run(session, RUN).step == 1000


def test_a_scripted_teacher_is_not_asked_the_whole_budget_at_one_step(lab: Lab) -> None:
    lab.request(small_config(feedback__kind="continuous", total_steps=500))
    assert lab.live() is RunState.FINISHED
    with lab.database.read() as session:
        steps = [fit.step for fit in fits_of(session, RUN)]
    assert len(steps) == len(set(steps)) == 4


def test_only_skips_end_exploration_never_and_the_history_says_so(lab: Lab) -> None:
    lab.request(
        small_config(
            feedback__teacher__kind="human",
            feedback__pace="block",
            feedback__budget=4,
            feedback__queries_per_session=2,
            total_steps=500,
        )
    )
    with Person(lab.database, RUN, lambda _query: Choice.SKIP):
        assert lab.live() is RunState.FINISHED
    with lab.database.read() as session:
        assert fits_of(session, RUN) == []


def test_a_finished_run_can_be_extended(lab: Lab) -> None:
    lab.request(small_config(checkpoints__keep_buffer=True))
    assert lab.live() is RunState.FINISHED
    with lab.database.write() as session:
        extend_run(session, RUN, total_steps=1200, budget=16)
    assert lab.live() is RunState.FINISHED
    with lab.database.read() as session:
        assert get_run(session, RUN).step == 1200
        assert get_run(session, RUN).answer_sequence == 16


def test_a_run_on_the_true_reward_asks_nobody(lab: Lab) -> None:
    config = small_config(reward__kind="true", feedback__kind="none", total_steps=600)
    lab.request(config)
    assert lab.live() is RunState.FINISHED
    with lab.database.read() as session:
        assert session.scalars(select(Query)).all() == []


def test_a_buffer_smaller_than_the_random_steps_does_not_keep_it_from_learning(lab: Lab) -> None:
    settings: dict[str, Any] = {
        "reward__kind": "true",
        "feedback__kind": "none",
        "exploration__kind": "random",
        "exploration__seed_steps": 1100,
        "agent__replay_capacity": 1000,
        "total_steps": 1300,
    }
    lab.request(small_config(**settings))
    assert lab.live() is RunState.FINISHED
    with lab.database.read() as session:
        told = session.scalars(select(Metric.step).where(Metric.name == "critic_loss")).all()
    assert min(told) >= 1000


@pytest.mark.parametrize(("known", "told"), [(False, 1), (True, 1)])
def test_an_early_end_that_nobody_knew_of_is_told_once(
    lab: Lab, monkeypatch: pytest.MonkeyPatch, known: bool, told: int
) -> None:
    """An end that random actions never found when the environment was added; a known one is told at the start."""
    entry = dataclasses.replace(catalogue.entry("gym:Hopper-v5"), ends_early=known)
    monkeypatch.setattr(run_config, "entry", lambda _: entry)
    changes: dict[str, Any] = {
        "environment__kind": "gym",
        "environment__id": "Hopper-v5",
        "feedback__segment_steps": 4,
    }
    lab.request(small_config(**changes, total_steps=320, environment__action_repeat=1))
    lab.live()
    with lab.database.read() as session:
        texts = session.scalars(select(Event.text)).all()
    assert sum("can end early" in text for text in texts) == told


def test_a_failing_run_says_why(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise FloatingPointError("the reward became nonsense")

    monkeypatch.setattr(RewardModel, "fit", broken)
    lab.request(small_config())
    assert lab.live() is RunState.FAILED
    with lab.database.read() as session:
        assert get_run(session, RUN).error == "FloatingPointError: the reward became nonsense"
