"""What the commands share that work until a signal ends them."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable

import structlog


def log_to_stderr() -> None:
    """Standard output is for what was asked for."""
    structlog.configure(logger_factory=structlog.PrintLoggerFactory(sys.stderr))


def on_ending_signals(end: Callable[[], object]) -> None:
    """Call it at SIGTERM and at Ctrl-C, instead of breaking off."""
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: end())


def leave_on_signals() -> threading.Event:
    """An event that they set."""
    leave = threading.Event()
    on_ending_signals(leave.set)
    return leave
