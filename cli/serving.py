"""`pebble up`, `serve`, `supervise`, `healthy`."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress

import typer

from cli.errors import UsageError
from cli.foreground import leave_on_signals, log_to_stderr
from labels_db.data_folder import DataFolder

FRESH_SECONDS = 15


def serve_pages(data: DataFolder, host: str, port: int, names: list[str]) -> None:
    """Serve until a signal ends it, saying where as soon as connections are taken."""
    from server.serve import serve

    with suppress(KeyboardInterrupt):  # uvicorn has shut down in order, then says how it was asked to
        serve(data, host=host, port=port, hosts=names, ready=_announce)


def _announce(url: str) -> None:
    typer.echo(f"\n  Pebble is ready:  {url}\n\n  Ctrl-C ends it; runs keep their last checkpoint.\n")


def bring_up(data: DataFolder, host: str, port: int, names: list[str], max_parallel_runs: int | None) -> None:
    """The pages in this process, the supervisor in a child that is started again should it die."""
    data.open_database().close()  # migrated once, before two processes look at it
    ending = threading.Event()
    keeper = threading.Thread(target=_keep_supervisor, args=(data, max_parallel_runs, ending))
    keeper.start()
    # uvicorn, shut down, raises its signal again: unhandled, these would end this process before its child.
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.default_int_handler)
    try:
        serve_pages(data, host, port, names)
    finally:
        ending.set()
        keeper.join()


def _keep_supervisor(data: DataFolder, max_parallel_runs: int | None, ending: threading.Event) -> None:
    command = [
        sys.executable,
        "-m",
        "cli",
        "supervise",
        "--data",
        str(data.path),
        "--parent",
        str(os.getpid()),
    ]
    if max_parallel_runs is not None:
        command += ["--max-parallel-runs", str(max_parallel_runs)]
    while not ending.is_set():
        # A session of its own: Ctrl-C in the terminal reaches this process, which then ends the child.
        child = subprocess.Popen(command, stdin=subprocess.DEVNULL, start_new_session=True)
        while child.poll() is None and not ending.wait(0.2):
            pass
        if child.poll() is None:
            child.terminate()
            child.wait()
        elif not ending.wait(2):
            typer.echo("The supervisor ended unexpectedly; starting it again.", err=True)


def supervise_runs(data: DataFolder, max_parallel_runs: int | None, parent: int | None = None) -> None:
    """Supervise until SIGTERM or SIGINT, or until the process that started this has gone without a word."""
    from trainer.supervisor import supervise

    log_to_stderr()
    leave = leave_on_signals()
    if parent is not None:
        threading.Thread(target=_leave_with, args=(parent, leave), daemon=True).start()
    supervise(data, leave, max_parallel_runs)


def _leave_with(parent: int, leave: threading.Event) -> None:
    while os.getppid() == parent and not leave.wait(0.5):
        pass
    leave.set()


def require_supervisor(data: DataFolder) -> None:
    """UsageError unless a supervisor has looked lately."""
    path = data.heartbeat_path
    age = time.time() - path.stat().st_mtime if path.exists() else float("inf")
    if age > FRESH_SECONDS:
        raise UsageError(f"{data.path}: no supervisor looks after it; start one with `pebble supervise`")
