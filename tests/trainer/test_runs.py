"""Whole small runs: what they record, that they go on exactly after any end, that they repeat."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import select

from labels_db.claims import Claim, attempt_died
from labels_db.models import (
    Answer,
    Choice,
    Desired,
    Metric,
    Query,
    QueryState,
    RunState,
)
from labels_db.records import evaluations_of, fits_of
from labels_db.run_config import RunConfig
from labels_db.runs import extend_run, get_run, resume_run, stop_run
from tests.trainer.conftest import RUN, Lab, new_lab, small_config
from tests.trainer.people import Person
from tests.trainer.whole_runs import goes_on_exactly, live_until, rows, weights
from trainer import precision
from trainer.attempt import Attempt
from trainer.posting import PeoplesDesk
from trainer.replay import replay
from trainer.replay_buffer import ReplayBuffer
from trainer.reward_model import RewardModel
from trainer.upkeep import RecordedUpkeep


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Lab:
    lab = new_lab(tmp_path_factory.mktemp("undisturbed"))
    lab.request(small_config())
    assert lab.live() is RunState.FINISHED
    return lab


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


def die_in_the_first_fit(path: Path, run_id: str, attempt: int) -> None:
    """Live the run in this process, and be killed between posting and fit."""

    def dying_fit(*_: object, **__: object) -> None:
        os.kill(os.getpid(), signal.SIGKILL)

    RewardModel.fit = dying_fit  # type: ignore[method-assign, assignment]
    lab = new_lab(path)
    Attempt(lab.data, Claim(run_id, attempt)).live()


def die_after_checkpoints(path: Path, run_id: str, attempt: int, count: int) -> None:
    """Live the run in this process, and be killed right after its n-th checkpoint, somewhere in training."""
    save, saved = RecordedUpkeep.save, []

    def dying_save(self: RecordedUpkeep, training: Any, **options: Any) -> None:
        save(self, training, **options)
        saved.append(training.step)
        if len(saved) == count:
            os.kill(os.getpid(), signal.SIGKILL)

    RecordedUpkeep.save = dying_save  # type: ignore[method-assign]
    lab = new_lab(path)
    Attempt(lab.data, Claim(run_id, attempt)).live()


def kill_and_go_on(lab: Lab, target: Any, *arguments: Any) -> None:
    claim = lab.claim()
    process = multiprocessing.get_context("spawn").Process(
        target=target, args=(lab.data.path, RUN, claim.attempt, *arguments)
    )
    process.start()
    process.join()
    assert process.exitcode == -signal.SIGKILL
    with lab.database.write() as session:
        attempt_died(session, claim, "killed by a test")
    assert lab.live() is RunState.FINISHED


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


def test_stopped_while_relabelling_it_ends_with_the_same_rows_and_weights(
    lab: Lab, undisturbed: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab.request(small_config())
    monkeypatch.setattr(ReplayBuffer, "RELABEL_ROWS", 100)
    obey, phases = RecordedUpkeep.obey, []

    def stopping(self: RecordedUpkeep) -> None:
        if self.progress.status.phase == "relabelling":
            phases.append("relabelling")
            if len(phases) == 2:
                with lab.database.write() as session:
                    stop_run(session, RUN)
                self.progress.listen()
        obey(self)

    monkeypatch.setattr(RecordedUpkeep, "obey", stopping)
    assert lab.live() is RunState.STOPPED
    assert len(phases) == 2  # it did not wait for the other parts
    with lab.database.write() as session:
        resume_run(session, RUN)
    assert lab.live() is RunState.FINISHED
    assert rows(lab) == rows(undisturbed)
    assert weights(lab) == weights(undisturbed)


def test_while_relabelling_it_is_seen_to_live_and_hears_of_a_stop(
    lab: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nobody looks on its behalf: what beats and listens is the run's other thread."""
    lab.request(small_config())
    relabel, beats, late = ReplayBuffer.relabel, set(), time.monotonic() + 60

    def observe() -> None:
        with lab.database.read() as session:
            run = get_run(session, RUN)
        if run.phase == "relabelling":
            beats.add(run.heartbeat_at)
        if len(beats) >= 2 and run.desired is not Desired.STOP:
            with lab.database.write() as session:
                stop_run(session, RUN)

    def lasting(self: ReplayBuffer, reward: Any, between_parts: Callable[[], None]) -> None:
        while time.monotonic() < late:
            relabel(self, reward, between_parts)
            observe()

    monkeypatch.setattr("trainer.progress.BEAT_SECONDS", 0.3)
    monkeypatch.setattr(ReplayBuffer, "relabel", lasting)
    assert lab.live() is RunState.STOPPED
    assert len(beats) >= 2


def test_equal_seeds_give_equal_runs_and_other_seeds_others(lab: Lab, undisturbed: Lab) -> None:
    lab.request(small_config(seed=2))
    lab.live()
    assert weights(lab) != weights(undisturbed)


# People ------------------------------------------------------------------------------------------


def people_config(**settings: Any) -> RunConfig:
    people = {"feedback__teacher__kind": "human", "total_steps": 1000, "feedback__budget": 8}
    return small_config(**{**people, **settings})


@pytest.mark.parametrize(
    "settings",
    [
        {"feedback__pace": "block"},
        {"feedback__pace": "stream", "feedback__fit_every": 3, "feedback__patience_steps": 100},
        {"feedback__kind": "continuous", "feedback__fit_every": 4, "feedback__patience_steps": 100},
    ],
    ids=["block", "stream", "continuous"],
)
def test_a_run_with_a_person_learns_from_their_answers_and_repeats_exactly(
    lab: Lab, settings: dict[str, Any]
) -> None:
    lab.request(people_config(**settings))
    with Person(lab.database, RUN) as person:
        assert lab.live() is RunState.FINISHED
    with lab.database.read() as session:
        fits, posted = fits_of(session, RUN), session.scalars(select(Query)).all()
        assert all(query.first.clip is not None for query in posted)
    assert person.given >= 6
    assert fits[-1].cursor >= 6
    assert fits[-1].preferences > 0
    repeated = replay(lab.database, lab.store, RUN, lambda _steps: None)
    assert repeated.same, repeated.sentence()
    with lab.database.write() as session:  # and it is the answers that matter, not only the seed
        answer = session.scalars(select(Answer).order_by(Answer.sequence)).first()
        assert answer is not None
        answer.choice = Choice.FIRST if answer.choice is Choice.SECOND else Choice.SECOND
    assert not replay(lab.database, lab.store, RUN, lambda _steps: None).same


def test_a_run_with_a_person_goes_on_after_a_kill_without_losing_an_answer(lab: Lab) -> None:
    lab.request(people_config(feedback__pace="block"))
    with Person(lab.database, RUN) as person:
        kill_and_go_on(lab, die_after_checkpoints, 2)
    with lab.database.read() as session:
        queries = session.scalars(select(Query)).all()
        answers = session.scalars(select(Answer)).all()
        fits = fits_of(session, RUN)
    assert len(answers) == person.given == len(queries)
    assert len({(q.session_id, q.index) for q in queries}) == len(queries)
    assert fits[-1].cursor == len(answers)
    assert replay(lab.database, lab.store, RUN, lambda _steps: None).same


def test_stopped_while_clips_are_drawn_it_asks_the_rest_when_it_goes_on(
    lab: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    post = PeoplesDesk._post

    def slow_post(self: PeoplesDesk, *arguments: Any) -> None:
        post(self, *arguments)
        with lab.database.write() as session:
            if get_run(session, RUN).desired is not Desired.STOP and get_run(session, RUN).attempt == 1:
                stop_run(session, RUN)
        time.sleep(1)

    monkeypatch.setattr(PeoplesDesk, "_post", slow_post)
    lab.request(people_config(feedback__pace="block", feedback__budget=4))
    assert lab.live() is RunState.STOPPED
    with lab.database.write() as session:
        assert len(session.scalars(select(Query)).all()) < 4
        resume_run(session, RUN)
    with Person(lab.database, RUN) as person:
        assert lab.live() is RunState.FINISHED
    assert person.given == 4


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


def test_a_failing_run_says_why(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise FloatingPointError("the reward became nonsense")

    monkeypatch.setattr(RewardModel, "fit", broken)
    lab.request(small_config())
    assert lab.live() is RunState.FAILED
    with lab.database.read() as session:
        assert get_run(session, RUN).error == "FloatingPointError: the reward became nonsense"
