"""What `pebble train` says while and after it trains."""

from __future__ import annotations

import io
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from rich.console import Console

from cli.tables import plain_console
from cli.train import _display, _given, _result, _say
from labels_db.answers import retract_answer
from labels_db.claims import attempt_died
from labels_db.data_folder import DataFolder
from labels_db.feedback_progress import read_inbox
from labels_db.models import Pressed
from tests.labels_db import given

ENDED: dict[str, Any] = {
    "run": "mill",
    "state": "failed",
    "steps": 700,
    "answers": 8,
    "return": None,
    "measures": {},
}


@pytest.mark.parametrize(
    "error",
    [
        "[Errno 28] No space left on device",
        "could not read [/data/runs]",
        "expected shape [3, 4], not [3]",
        "the line :warning: is no picture",
    ],
)
def test_an_error_is_printed_as_it_is(error: str, capsys: pytest.CaptureFixture[str]) -> None:
    _say(plain_console(), {**ENDED, "error": error})
    assert error in capsys.readouterr().out


def test_a_run_that_was_taken_from_it_is_told_as_it_stands(tmp_path: Path) -> None:
    with DataFolder(tmp_path).open_database() as database:
        with database.write() as session:
            owner = given.a_claim(session)
            attempt_died(session, owner, "silent")
        told = _result(database, owner.run_id, None, {})
    assert (told["state"], "was taken from it" in told["error"]) == ("queued", True)


def test_the_progress_line_counts_the_answers_that_count(tmp_path: Path) -> None:
    """Of four answers one was a skip and one was taken back: five entries in the record, two that count."""
    screen = io.StringIO()
    with DataFolder(tmp_path).open_database() as database:
        with database.write() as session:
            owner = given.a_claim(session)
            given.queries(session, owner, 4)
            for number, lease in enumerate(given.leases(session, given.labeller(session), 4)):
                pressed = Pressed.SKIP if number == 0 else Pressed.LEFT
                given.an_answer(session, lease, f"a-{number}", pressed=pressed)
            retract_answer(session, "a-3", lease.labeller_id, answer_id="r-3", now=given.NOW)
            inbox = read_inbox(session, "mill")
        assert inbox.sequence == 5
        status = SimpleNamespace(step=10, phase="training")
        attempt = SimpleNamespace(run=SimpleNamespace(progress=SimpleNamespace(status=status, inbox=inbox)))
        console = Console(file=screen, force_terminal=True, width=120)
        with _display(attempt, console, given.HUMAN, lambda: _given(database, "mill")):
            until = time.monotonic() + 10
            while "answers" not in screen.getvalue() and time.monotonic() < until:
                time.sleep(0.05)
    assert f"2 of {given.HUMAN.budget} answers" in screen.getvalue()
