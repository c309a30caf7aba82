"""A run's life: asked for, claimed, owned by one attempt, interrupted, ended, asked for again."""

from __future__ import annotations

from collections.abc import Callable
from datetime import timedelta
from pathlib import Path

import pytest
from sqlalchemy import select
from sqlalchemy.orm import Session

from labels_db import claims, feedback_sessions, records, runs
from labels_db.claims import HUNG_AFTER, STALE_AFTER, Claim, Report
from labels_db.database import Database
from labels_db.errors import AttemptLostError, ConflictError, NotFoundError
from labels_db.models import ALIVE, Desired, Event, FeedbackSession, Phase, Run, RunState
from labels_db.overrides import SettingError
from labels_db.storage import ArtifactStore
from tests.labels_db import given
from tests.labels_db.given import NOW, SECOND


def test_a_requested_run_waits_with_its_first_goal_card(database: Database) -> None:
    with database.write() as session:
        run_id = runs.request_run(session, given.HUMAN, title="T", goal="Round.", preset="windmill").id
    with database.read() as session:
        run = runs.get_run(session, run_id)
        assert run_id.startswith("windmill-")
        assert (run.state, run.desired, run.attempt) == (RunState.QUEUED, Desired.RUN, 0)
        assert [(card.version, card.text) for card in run.goal_cards] == [(1, "Round.")]
        assert runs.config_of(run) == given.HUMAN


def test_a_run_of_an_environments_own_preset_has_an_id_that_files_can_have(
    database: Database, tmp_path: Path
) -> None:
    with database.write() as session:
        run_id = runs.request_run(session, given.HUMAN, title="T", goal="G", preset="gym:Hopper-v5").id
    assert run_id.startswith("gym-Hopper-v5-")
    ArtifactStore(str(tmp_path)).write(f"runs/{run_id}/x.json", b"{}")


def test_an_unknown_run_is_named(database: Database) -> None:
    with database.read() as session, pytest.raises(NotFoundError, match="run 'nix'"):
        runs.get_run(session, "nix")


def test_the_queue_is_first_come_first_served(database: Database) -> None:
    with database.write() as session:
        for place, name in enumerate(("third", "first", "second")):
            given.a_run(session, name, at=NOW + SECOND * ((place + 2) % 3))
        assert claims.queue_positions(session) == {"first": 1, "second": 2, "third": 3}
        claimed = [claims.claim_run(session, "s", max_parallel=9, now=NOW) for _ in range(4)]
    assert [found and found.run_id for found in claimed] == ["first", "second", "third", None]


def test_no_more_runs_are_claimed_than_may_be_alive(database: Database) -> None:
    with database.write() as session:
        given.a_run(session, "one")
        given.a_run(session, "two")
        owner = claims.claim_run(session, "s", max_parallel=1, now=NOW)
        assert owner is not None
        assert claims.claim_run(session, "s", max_parallel=1, now=NOW) is None
        claims.finish_run(session, owner)
        assert claims.claim_run(session, "s", max_parallel=1, now=NOW) == Claim("two", 1)


def test_an_experiment_s_runs_do_not_wait_for_others(database: Database) -> None:
    with database.write() as session:
        for name in ("other", "ours"):
            given.a_run(session, name)
        runs.get_run(session, "ours").experiment = "tiny"
        assert claims.claim_run(session, "s", max_parallel=1, now=NOW) == Claim("other", 1)
        assert claims.claim_run(session, "s", max_parallel=1, now=NOW) is None
        claimed = [
            claims.claim_run(session, "s", max_parallel=1, now=NOW, experiment="tiny") for _ in range(2)
        ]
    assert claimed == [Claim("ours", 1), None]


def test_only_a_queued_run_can_be_claimed(database: Database) -> None:
    with database.write() as session:
        given.a_claim(session)
        with pytest.raises(ConflictError, match="cannot start while starting"):
            claims.claim(session, runs.get_run(session, "mill"), "late", now=NOW)


def test_a_beat_records_the_report_and_returns_what_is_wanted(database: Database) -> None:
    report = Report(RunState.WAITING, Phase.WAITING, 1200, 88.5, wanted_answers=7, next_session_step=3000)
    with database.write() as session:
        owner = given.a_claim(session)
        assert claims.beat(session, owner, report, now=NOW + SECOND) is Desired.RUN
        runs.pause_run(session, "mill")
        assert claims.beat(session, owner, report, now=NOW + SECOND) is Desired.PAUSE
    with database.read() as session:
        run = runs.get_run(session, "mill")
        assert (run.state, run.phase, run.step, run.wanted_answers) == ("waiting", "waiting", 1200, 7)
        assert (run.heartbeat_at, run.progress_at) == (NOW + SECOND, NOW)


# Fencing -----------------------------------------------------------------------------------------

TRAINER_WRITES: dict[str, Callable[[Session, Claim], object]] = {
    "beat": lambda s, c: claims.beat(s, c, Report(RunState.RUNNING, Phase.TRAINING, 1), now=NOW),
    "finish": claims.finish_run,
    "fail": lambda s, c: claims.fail_run(s, c, "boom"),
    "stop": claims.acknowledge_stop,
    "yield": claims.yield_run,
    "progress": claims.made_progress,
    "session": lambda s, c: feedback_sessions.open_session(s, c, index=0, step=0, asked=1),
    "query": lambda s, c: feedback_sessions.post_query(
        s,
        c,
        FeedbackSession(id=1),
        index=0,
        segments=(given.a_segment("mill", 0), given.a_segment("mill", 1)),
        scheme="uniform",
        score=None,
    ),
    "supersede": lambda s, c: feedback_sessions.supersede_queries(s, c, before=1),
    "trim": lambda s, c: feedback_sessions.trim_session(s, c, 1),
    "metrics": lambda s, c: records.record_metrics(s, c, [records.Measurement(1, "loss", 1.0)]),
    "fit": lambda s, c: records.record_fit(
        s, c, index=0, step=0, cursor=0, report=records.FitReport(1, 1, None, None), probabilities={}
    ),
    "evaluation": lambda s, c: records.record_evaluation(
        s, c, step=0, returns=[1.0], measures={}, video_key=None
    ),
    "video": lambda s, c: records.attach_video(s, c, step=0, video_key="v"),
    "checkpoint": lambda s, c: records.record_checkpoint(s, c, step=0, manifest_key="m", checksum="c"),
    "forget": lambda s, c: records.forget_checkpoints(s, c, []),
    "rewind": lambda s, c: records.rewind(s, c, step=0, fits=0),
}


@pytest.mark.parametrize("write", TRAINER_WRITES.values(), ids=TRAINER_WRITES)
def test_an_attempt_that_lost_its_run_writes_nothing(
    database: Database, write: Callable[[Session, Claim], object]
) -> None:
    with database.write() as session:
        zombie = given.a_claim(session)
        claims.interrupt_run(session, runs.get_run(session, "mill"), "gone")
        claims.claim_run(session, "next", max_parallel=1, now=NOW)
    with database.write() as session, pytest.raises(AttemptLostError, match="attempt 1 lost it"):
        write(session, zombie)


def test_an_ended_run_takes_no_more_writes(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        claims.finish_run(session, owner)
        with pytest.raises(AttemptLostError, match="now finished"):
            claims.made_progress(session, owner)


# Interruptions -----------------------------------------------------------------------------------


def _die(session: Session, *, progress: bool = False) -> RunState:
    """One attempt starts, perhaps writes a checkpoint, and falls silent."""
    owner = claims.claim_run(session, "s", max_parallel=1, now=NOW)
    assert owner is not None
    if progress:
        claims.made_progress(session, owner)
    claims.beat(session, owner, claims.Report(RunState.RUNNING, Phase.TRAINING, 1), now=NOW)
    assert claims.interrupt_stale(session, now=NOW + STALE_AFTER) == []
    assert claims.interrupt_stale(session, now=NOW + STALE_AFTER + SECOND) == ["mill"]
    return runs.get_run(session, "mill").state


def test_a_starting_or_living_trainer_may_be_silent_for_longer(database: Database) -> None:
    """Libraries load slowly from a cold disk, and a laptop may sleep while its trainer lives."""
    with database.write() as session:
        given.a_run(session)
        owner = claims.claim_run(session, "s", max_parallel=1, now=NOW)
        assert owner is not None
        assert claims.interrupt_stale(session, now=NOW + HUNG_AFTER) == []
        claims.beat(session, owner, claims.Report(RunState.RUNNING, Phase.TRAINING, 1), now=NOW)
        assert claims.interrupt_stale(session, now=NOW + HUNG_AFTER, living={"mill"}) == []
        assert claims.interrupt_stale(session, now=NOW + HUNG_AFTER + SECOND, living={"mill"}) == ["mill"]


def test_three_attempts_without_progress_fail_a_run(database: Database) -> None:
    with database.write() as session:
        given.a_run(session)
        assert [_die(session) for _ in range(3)] == ["queued", "queued", "failed"]
        assert "3 attempts in a row made no progress" in (runs.get_run(session, "mill").error or "")


def test_progress_starts_the_count_anew(database: Database) -> None:
    with database.write() as session:
        given.a_run(session)
        deaths = [_die(session, progress=number == 2) for number in range(5)]
        assert deaths == ["queued", "queued", "queued", "queued", "queued"]
        assert _die(session) == "failed"


def test_a_trainer_that_beats_is_left_alone(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        late = NOW + timedelta(hours=1)
        claims.beat(session, owner, Report(RunState.RUNNING, Phase.TRAINING, 1), now=late)
        assert claims.interrupt_stale(session, now=late + SECOND) == []


def test_a_run_asked_to_stop_is_stopped_when_its_trainer_dies(database: Database) -> None:
    with database.write() as session:
        given.a_claim(session)
        runs.stop_run(session, "mill")
        claims.interrupt_run(session, runs.get_run(session, "mill"), "gone")
        assert runs.get_run(session, "mill").state is RunState.STOPPED


def test_a_dead_process_is_interrupted_unless_it_had_given_the_run_up(database: Database) -> None:
    with database.write() as session:
        first = given.a_claim(session)
        claims.attempt_died(session, first, "killed")
        assert runs.get_run(session, "mill").state is RunState.QUEUED
        second = claims.claim_run(session, "s", max_parallel=1, now=NOW)
        assert second is not None
        claims.attempt_died(session, first, "reaped late")
        assert runs.get_run(session, "mill").state is RunState.STARTING
        claims.finish_run(session, second)
        claims.attempt_died(session, second, "its usual end")
        assert runs.get_run(session, "mill").state is RunState.FINISHED


def test_a_trainer_that_has_waited_for_people_for_a_while_is_not_fruitless(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        waits = Report(RunState.WAITING, Phase.WAITING, 1, progress_at=NOW)
        run = runs.get_run(session, "mill")
        claims.beat(session, owner, waits, now=NOW + SECOND)
        assert run.fruitless_attempts == 1
        claims.beat(session, owner, waits, now=NOW + STALE_AFTER + SECOND)
        assert run.fruitless_attempts == 0


def test_a_run_extended_while_it_ends_goes_on(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        before = runs.config_of(runs.get_run(session, "mill")).total_steps
        claims.beat(session, owner, Report(RunState.RUNNING, Phase.TRAINING, before), now=NOW)
        runs.extend_run(session, "mill", total_steps=before + 1000, budget=None)
        assert claims.finish_or_go_on(session, owner, total_steps=before) is RunState.QUEUED
        second = claims.claim_run(session, "s", max_parallel=1, now=NOW)
        assert second is not None
        assert claims.finish_or_go_on(session, second, total_steps=before + 1000) is RunState.FINISHED


def test_a_finished_run_is_not_extended_by_answers_alone(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        steps = runs.config_of(runs.get_run(session, "mill")).total_steps
        claims.beat(session, owner, Report(RunState.RUNNING, Phase.TRAINING, steps), now=NOW)
        claims.finish_run(session, owner)
        with pytest.raises(ConflictError, match="more answers need more steps"):
            runs.extend_run(session, "mill", total_steps=None, budget=100)
    with database.read() as session:
        assert runs.config_of(runs.get_run(session, "mill")).budget == 50


def test_a_paused_run_stays_paused_through_a_shutdown(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        runs.pause_run(session, "mill")
        claims.yield_run(session, owner)
        run = runs.get_run(session, "mill")
        assert (run.state, run.desired, run.fruitless_attempts) == ("queued", "pause", 0)
        owner = claims.claim(session, run, "next", now=NOW)
        assert claims.beat(session, owner, Report(RunState.PAUSED, Phase.PAUSED, 1), now=NOW) is Desired.PAUSE


def test_an_ended_attempt_leaves_no_claims_about_itself(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        claims.beat(
            session, owner, Report(RunState.WAITING, Phase.WAITING, 9, 3.0, wanted_answers=4), now=NOW
        )
        claims.yield_run(session, owner)
        run = runs.get_run(session, "mill")
        assert (run.owner, run.phase, run.steps_per_second, run.wanted_answers) == (None, "", None, 0)
        assert run.step == 9


# What people may ask in which state ----------------------------------------------------------------

R, P, S = Desired.RUN, Desired.PAUSE, Desired.STOP
State = RunState
Asked = tuple[RunState, Desired]

REFUSED = None
ANSWERS: dict[Asked, dict[str, Asked | None]] = {
    (State.QUEUED, R): {"pause": REFUSED, "resume": REFUSED, "stop": (State.STOPPED, R)},
    (State.QUEUED, P): {"pause": REFUSED, "resume": (State.QUEUED, R), "stop": (State.STOPPED, R)},
    **{
        (alive, R): {
            "pause": (alive, P),
            "resume": (alive, R) if alive is State.PAUSED else REFUSED,
            "stop": (alive, S),
        }
        for alive in ALIVE
    },
    **{(alive, P): {"pause": (alive, P), "resume": (alive, R), "stop": (alive, S)} for alive in ALIVE},
    **{(alive, S): {"pause": REFUSED, "resume": REFUSED, "stop": (alive, S)} for alive in ALIVE},
    (State.FINISHED, R): {"pause": REFUSED, "resume": REFUSED, "stop": REFUSED},
    (State.FAILED, R): {"pause": REFUSED, "resume": (State.QUEUED, R), "stop": REFUSED},
    (State.STOPPED, R): {"pause": REFUSED, "resume": (State.QUEUED, R), "stop": REFUSED},
}
ACTIONS = {"pause": runs.pause_run, "resume": runs.resume_run, "stop": runs.stop_run}
CASES = [(before, action, after) for before, row in ANSWERS.items() for action, after in row.items()]


@pytest.mark.parametrize(("before", "action", "after"), CASES)
def test_what_may_be_asked_in_which_state(
    database: Database, before: Asked, action: str, after: Asked | None
) -> None:
    with database.write() as session:
        run = given.a_run(session)
        run.state, run.desired = before
        if after is REFUSED:
            with pytest.raises(ConflictError, match=f"run mill: cannot {action} while"):
                ACTIONS[action](session, "mill")
        else:
            ACTIONS[action](session, "mill")
            assert (run.state, run.desired) == after


def test_resuming_a_failed_run_forgives_its_failures(database: Database) -> None:
    with database.write() as session:
        run = given.a_run(session)
        run.state, run.error, run.fruitless_attempts = RunState.FAILED, "boom", 3
        runs.resume_run(session, "mill")
        assert run.error is None
        assert run.fruitless_attempts == 0


@pytest.mark.parametrize("state", [state for state in RunState if state is not RunState.FINISHED])
def test_extending_changes_the_budget_where_the_run_stands(database: Database, state: RunState) -> None:
    with database.write() as session:
        given.a_run(session).state = state
        runs.extend_run(session, "mill", total_steps=None, budget=80)
        run = runs.get_run(session, "mill")
        assert (run.state, runs.config_of(run).budget) == (state, 80)
        assert runs.config_of(run).total_steps == given.HUMAN.total_steps


def test_extending_a_finished_run_queues_it_again(database: Database) -> None:
    with database.write() as session:
        given.a_run(session).state = RunState.FINISHED
        run = runs.extend_run(session, "mill", total_steps=90_000, budget=None)
        assert (run.state, runs.config_of(run).total_steps) == (RunState.QUEUED, 90_000)


@pytest.mark.parametrize(
    ("steps", "budget", "error", "message"),
    [
        (0, None, ConflictError, "total_steps 0: a run can only be extended; it already has"),
        (None, 49, ConflictError, "feedback.budget 49: a run can only be extended; it already has 50"),
        (10**12, None, SettingError, "total_steps: "),
    ],
)
def test_a_run_is_never_shortened(
    database: Database, steps: int | None, budget: int | None, error: type[Exception], message: str
) -> None:
    with database.write() as session:
        given.a_run(session)
        with pytest.raises(error, match=message):
            runs.extend_run(session, "mill", total_steps=steps, budget=budget)
        assert runs.config_of(session.get_one(Run, "mill")) == given.HUMAN


def test_a_runs_history_is_told_in_sentences(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        session.get_one(Run, "mill").step = 12_400
        runs.stop_run(session, "mill")
        claims.acknowledge_stop(session, owner)
        told = session.scalars(select(Event.text).order_by(Event.id)).all()
    assert told == [
        "Asked for.",
        "Attempt 1 starts.",
        "Stop asked for.",
        "Stopped at step 12\u202f400. Resume continues from there.",
    ]
