"""Where runs live: a launcher gives each a process; here a child of this machine."""

from __future__ import annotations

import subprocess
import sys
from typing import Protocol

from labels_db.claims import Claim
from labels_db.data_folder import DataFolder


class Handle(Protocol):
    """A launched run."""

    def poll(self) -> int | None:
        """Its exit status once it has ended; negative for the signal that killed it."""

    def terminate(self) -> None:
        """Ask it to write a checkpoint and go."""

    def kill(self) -> None:
        """End it at once; its run goes on from its last checkpoint."""

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its end."""


class Launcher(Protocol):
    def launch(self, claim: Claim) -> Handle:
        """Start the trainer of a claimed run."""


class LocalLauncher:
    """One child process per run, in a session of its own, so that it outlives whoever started it."""

    def __init__(self, data: DataFolder) -> None:
        self.data = data

    def launch(self, claim: Claim) -> Handle:
        log = self.data.log_path(claim.run_id)
        log.parent.mkdir(parents=True, exist_ok=True)
        command = [
            sys.executable,
            "-m",
            "trainer.process",
            claim.run_id,
            str(claim.attempt),
            str(self.data.path),
        ]
        if self.data.artifacts_url is not None:
            command.append(self.data.artifacts_url)
        with log.open("ab") as output:
            return subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
