"""The supervisor: claims queued runs, gives each a process, notices when one dies, does commands of ended runs.

Any number of supervisors may share a record; a claim is one transaction, so no two ever own one run. This
module imports neither torch nor a simulator: it starts at once and stays small.
"""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import threading
import time
from dataclasses import dataclass, field

import structlog

from labels_db import commands
from labels_db.claims import Claim, attempt_died, claim_run, interrupt_stale
from labels_db.data_folder import DataFolder
from labels_db.database import Database
from labels_db.log_tail import log_tail
from labels_db.models import utc_now
from labels_db.policy_commands import POLICY_COMMANDS
from trainer.cores import available_cores
from trainer.launcher import Handle, Launcher, LocalLauncher

log = structlog.get_logger()

LOOK_SECONDS = 0.5
LEAVE_SECONDS = 60
LOG_LINES = 12


def default_parallel_runs() -> int:
    """One run for every two cores: a run also renders, and the server wants to answer."""
    return max(1, available_cores() // 2)


@dataclass(frozen=True)
class Doing:
    """A command and the process that does it."""

    command_id: int
    process: subprocess.Popen[bytes]
    began: float = field(default_factory=time.monotonic)

    def hangs(self) -> bool:
        return time.monotonic() - self.began > commands.GIVEN_UP_AFTER.total_seconds()


@dataclass
class Supervisor:
    """Looks after the runs of one installation until `leave` is set."""

    data: DataFolder
    database: Database
    launcher: Launcher
    max_parallel: int = field(default_factory=default_parallel_runs)
    leave: threading.Event = field(default_factory=threading.Event)
    experiment: str | None = None
    """Whose runs alone are claimed, if any."""
    children: dict[Claim, Handle] = field(default_factory=dict)
    doing: Doing | None = None

    @property
    def name(self) -> str:
        return f"{socket.gethostname()}:{os.getpid()}"

    def watch(self) -> None:
        """Look, act, rest; when told to leave, let every run write its checkpoint."""
        while not self.leave.wait(LOOK_SECONDS):
            self.data.heartbeat_path.touch()
            self.look()
        self.end_children()

    def look(self) -> None:
        """Everything that is due now."""
        self.reap()
        self.end_hung()
        self.start_queued()
        self.start_command()

    def end_hung(self) -> None:
        """Runs that have fallen silent are queued again; a process of ours that hangs must not stay beside the next."""
        with self.database.write() as session:
            silent = interrupt_stale(session, now=utc_now(), living={claim.run_id for claim in self.children})
        for claim, child in self.children.items():
            if claim.run_id in silent:
                log.warning("killing", run=claim.run_id, attempt=claim.attempt)
                child.kill()

    def start_queued(self) -> None:
        while (claim := self._claim()) is not None:
            log.info("starting", run=claim.run_id, attempt=claim.attempt)
            self.children[claim] = self.launcher.launch(claim)

    def _claim(self) -> Claim | None:
        with self.database.write() as session:
            return claim_run(
                session,
                self.name,
                max_parallel=self.max_parallel,
                now=utc_now(),
                experiment=self.experiment,
            )

    def reap(self) -> None:
        """Learn which children have ended, and hand on the runs of those that died."""
        ended = {
            claim: status for claim, child in self.children.items() if (status := child.poll()) is not None
        }
        for claim, status in ended.items():
            del self.children[claim]
            self._bury(claim, status)

    def _bury(self, claim: Claim, status: int) -> None:
        log.info("ended", run=claim.run_id, attempt=claim.attempt, status=status)
        tail = "\n".join(log_tail(self.data.log_path(claim.run_id), LOG_LINES))
        with self.database.write() as session:
            attempt_died(
                session, claim, f"The trainer's process {_how_it_ended(status)}. The end of its log:\n{tail}"
            )

    def start_command(self) -> None:
        """One command at a time, in a process of its own."""
        if self.doing is not None and not self._is_over(self.doing):
            return
        with self.database.write() as session:
            taken = commands.take_of_ended_runs(session, POLICY_COMMANDS)
            command_id = None if taken is None else taken.id
        self.doing = None if command_id is None else self._do(command_id)

    def _do(self, command_id: int) -> Doing:
        arguments = [sys.executable, "-m", "trainer.commands", str(command_id), str(self.data.path)]
        arguments += [self.data.artifacts_url] if self.data.artifacts_url else []
        return Doing(command_id, subprocess.Popen(arguments, stdin=subprocess.DEVNULL))

    def _is_over(self, doing: Doing) -> bool:
        """Whoever asked hears of a process that died over the command, or was killed for hanging, too."""
        if hung := doing.hangs():
            doing.process.kill()
            doing.process.wait()
        if (status := doing.process.poll()) is None:
            return False
        minutes = commands.GIVEN_UP_AFTER.total_seconds() / 60
        reason = f"took longer than {minutes:.0f} minutes and was ended" if hung else _how_it_ended(status)
        with self.database.write() as session:
            commands.give_up(session, doing.command_id, f"Its process {reason}.")
        return True

    def end_children(self) -> None:
        """Ask every run to write its checkpoint and go; whoever does not in time goes on by itself."""
        for child in self.children.values():
            child.terminate()
        for claim, child in list(self.children.items()):
            try:
                child.wait(timeout=LEAVE_SECONDS)
            except subprocess.TimeoutExpired:
                log.warning("still running", run=claim.run_id)
        self.reap()


def _how_it_ended(status: int) -> str:
    return f"was killed by signal {-status}" if status < 0 else f"ended with status {status}"


def supervise(data: DataFolder, leave: threading.Event, max_parallel: int | None = None) -> None:
    """Look after an installation's runs until `leave` is set."""
    database = data.open_database()
    try:
        supervisor = Supervisor(
            data, database, LocalLauncher(data), max_parallel or default_parallel_runs(), leave
        )
        supervisor.watch()
    finally:
        database.close()
