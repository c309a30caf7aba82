"""The supervisor with real processes: claims, deaths, shutdown, commands."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import timedelta

import pytest

from labels_db import commands
from labels_db.claims import HUNG_AFTER, Claim, queue_positions
from labels_db.data_folder import DataFolder
from labels_db.models import Command, RunState, utc_now
from labels_db.runs import get_run, stop_run
from tests.trainer.conftest import RUN, Lab, small_config
from trainer.launcher import Handle, LocalLauncher
from trainer.supervisor import Supervisor


@dataclass
class ScriptLauncher:
    """Launches a Python one-liner instead of a trainer."""

    data: DataFolder
    script: str
    claims: list[Claim] = field(default_factory=list)

    def launch(self, claim: Claim) -> Handle:
        self.claims.append(claim)
        log = self.data.log_path(claim.run_id)
        log.parent.mkdir(exist_ok=True)
        with log.open("ab") as output:
            return subprocess.Popen([sys.executable, "-c", self.script], stdout=output, stderr=output)


SLEEPS = "import time; time.sleep(60)"


def until(condition: Callable[[], bool], seconds: float = 120) -> None:
    ends = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < ends, "waited in vain"
        time.sleep(0.1)


def state(lab: Lab, run_id: str = RUN) -> RunState:
    with lab.database.read() as session:
        return get_run(session, run_id).state


def test_a_process_that_keeps_dying_fails_the_run_with_the_end_of_its_log(lab: Lab) -> None:
    lab.request(small_config())
    launcher = ScriptLauncher(lab.data, "print('the last words'); raise SystemExit(3)")
    supervisor = Supervisor(lab.data, lab.database, launcher)

    def fails() -> bool:
        supervisor.look()
        return state(lab) is RunState.FAILED

    until(fails)
    assert len(launcher.claims) == 3
    with lab.database.read() as session:
        error = get_run(session, RUN).error or ""
    assert "3 attempts in a row made no progress" in error
    assert "ended with status 3" in error
    assert "the last words" in error


def test_one_run_at_a_time_and_no_run_twice(lab: Lab) -> None:
    for name in ("a", "b", "c"):
        lab.request(small_config(), name)
    launcher = ScriptLauncher(lab.data, SLEEPS)
    supervisors = [Supervisor(lab.data, lab.database, launcher, max_parallel=2) for _ in range(2)]
    threads = [threading.Thread(target=supervisor.look) for supervisor in supervisors]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    try:
        assert sorted(claim.run_id for claim in launcher.claims) == ["a", "b"]
        with lab.database.read() as session:
            assert queue_positions(session) == {"c": 1}
    finally:
        for supervisor in supervisors:
            supervisor.end_children()


@pytest.fixture
def watched(lab: Lab) -> Supervisor:
    return Supervisor(lab.data, lab.database, LocalLauncher(lab.data), max_parallel=1)


def test_a_killed_run_goes_on_and_finishes_then_its_commands_are_done(lab: Lab, watched: Supervisor) -> None:
    lab.request(small_config(total_steps=5000, feedback__steps_between=2000))
    watched.look()
    (claim, child), *_ = watched.children.items()
    assert isinstance(child, subprocess.Popen)

    def has_checkpoint() -> bool:
        with lab.database.read() as session:
            return get_run(session, RUN).fruitless_attempts == 0

    until(has_checkpoint)
    os.kill(child.pid, signal.SIGKILL)
    until(lambda: watched.look() or claim not in watched.children)  # type: ignore[func-returns-value]
    with lab.database.read() as session:
        assert get_run(session, RUN).attempt == 2

    def finished() -> bool:
        watched.look()
        return state(lab) is RunState.FINISHED

    until(finished)
    log = lab.data.log_path(RUN).read_text()
    assert "--- attempt 1 of tiny ---" in log
    assert "--- attempt 2 of tiny ---" in log
    with lab.database.write() as session:
        asked = commands.ask(session, RUN, "evaluate", asked_by="test", episodes=2).id

    def answered() -> bool:
        watched.look()
        with lab.database.read() as session:
            return session.get_one(Command, asked).done_at is not None

    until(answered)
    assert watched.doing is not None
    watched.doing.process.wait(timeout=60)  # it answers before it ends
    with lab.database.read() as session:
        result = session.get_one(Command, asked).result
    assert result is not None
    assert len(result["returns"]) == 2
    assert "turns" in result["measures"]


def test_a_shutdown_leaves_runs_queued_with_a_checkpoint(lab: Lab, watched: Supervisor) -> None:
    lab.request(small_config(total_steps=100_000))
    watched.look()
    until(lambda: state(lab) is RunState.RUNNING)
    watched.end_children()
    with lab.database.read() as session:
        run = get_run(session, RUN)
        assert run.state is RunState.QUEUED
        assert run.fruitless_attempts == 0
        assert run.step > 0


def test_a_command_whose_process_is_killed_is_answered_with_that(lab: Lab, watched: Supervisor) -> None:
    lab.request(small_config())
    with lab.database.write() as session:
        stop_run(session, RUN)  # a queued run stops at once
        asked = commands.ask(session, RUN, "evaluate", asked_by="test").id
    watched.look()
    assert watched.doing is not None
    watched.doing.process.kill()
    watched.doing.process.wait()
    watched.look()
    with lab.database.read() as session:
        assert session.get_one(Command, asked).result == {"error": "Its process was killed by signal 9."}
    assert watched.doing is None


def test_a_command_that_hangs_is_killed_and_makes_way(lab: Lab, watched: Supervisor) -> None:
    lab.request(small_config())
    with lab.database.write() as session:
        stop_run(session, RUN)
        asked = commands.ask(session, RUN, "evaluate", asked_by="test").id
    watched.look()
    assert watched.doing is not None
    process = watched.doing.process
    watched.doing = replace(
        watched.doing, began=time.monotonic() - commands.GIVEN_UP_AFTER.total_seconds() - 1
    )
    watched.look()
    assert process.poll() == -signal.SIGKILL
    assert watched.doing is None
    with lab.database.read() as session:
        assert session.get_one(Command, asked).result == {
            "error": "Its process took longer than 15 minutes and was ended."
        }


def test_a_trainer_that_hangs_is_killed_before_the_next_takes_its_place(lab: Lab) -> None:
    lab.request(small_config())
    launcher = ScriptLauncher(lab.data, SLEEPS)
    watched = Supervisor(lab.data, lab.database, launcher, max_parallel=1)
    watched.look()
    (hung,) = watched.children.values()
    with lab.database.write() as session:
        get_run(session, RUN).heartbeat_at = utc_now() - HUNG_AFTER - timedelta(seconds=1)
    watched.look()
    assert hung.wait(timeout=10) == -signal.SIGKILL
    assert [claim.attempt for claim in launcher.claims] == [1, 2]
    until(lambda: watched.look() or len(watched.children) == 1)  # type: ignore[func-returns-value]
    assert state(lab) is RunState.STARTING
    watched.end_children()


def test_only_a_supervisor_of_all_runs_says_that_there_is_one(lab: Lab) -> None:
    """`pebble experiment` looks after its own runs alone."""
    supervisor = Supervisor(lab.data, lab.database, LocalLauncher(lab.data), experiment="laptop")
    supervisor.look()
    assert not lab.data.heartbeat_path.exists()
