"""`pebble train`: one run in the foreground, with its progress."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from cli.errors import UsageError
from cli.foreground import log_to_stderr, on_ending_signals
from cli.settings import by_name
from cli.tables import plain_console
from labels_db.claims import Claim, claim
from labels_db.data_folder import DataFolder
from labels_db.database import Database
from labels_db.feedback_progress import feedback_progress
from labels_db.methods import method_named
from labels_db.models import RunState, utc_now
from labels_db.overrides import SettingError, with_settings
from labels_db.presets import preset_named
from labels_db.run_config import RunConfig
from labels_db.runs import get_run, request_run
from trainer.threads import wait_asleep

OPTIONS = {
    "feedback.teacher.kind": "--teacher",
    "feedback.budget": "--labels",
    "total_steps": "--steps",
    "seed": "--seed",
}
ENDS = {RunState.FINISHED: 0, RunState.STOPPED: 0, RunState.QUEUED: 0}
TAKEN = "This process was silent for so long that the run was taken from it; another one goes on with it."


def chosen_config(
    preset: str,
    profile: str | None,
    shortcuts: Mapping[str, object],
    settings: list[str],
    method: str | None = None,
) -> RunConfig:
    """The preset's profile with the options' values; UsageError names the option that is wrong."""
    try:
        config = method_named(method or "pebble").config(preset_named(preset), profile)
    except ValueError as error:
        raise UsageError(str(error)) from error
    changes = {path: str(value) for path, value in shortcuts.items() if value is not None}
    changes |= by_name(settings, "PATH=VALUE, as in --set feedback.budget=50")
    try:
        return with_settings(config, changes)
    except SettingError as error:
        raise UsageError(f"{OPTIONS.get(error.path, f'--set {error.path}')}: {error.message}") from error


def train_here(
    preset: str, config: RunConfig, data: DataFolder, *, method: str | None = None, as_json: bool
) -> int:
    """Train in this process; 0 unless the run failed. Ctrl-C stops it with a checkpoint."""
    wait_asleep(config)
    from trainer.attempt import Attempt

    log_to_stderr()
    console = plain_console(stderr=as_json)
    with data.open_database() as database:
        owned = _own_run(database, preset, config, method)
        attempt = Attempt(data, owned)
        console.print(f"Run {owned.run_id}")
        on_ending_signals(attempt.stop)
        with _display(attempt, console, config, lambda: _given(database, owned.run_id)):
            state = attempt.live()
        result = _result(database, owned.run_id, state, attempt.last_measures)
    print(json.dumps(result)) if as_json else _say(console, result)
    return 1 if state is None else ENDS.get(state, 1)


def _own_run(database: Database, preset: str, config: RunConfig, method: str | None) -> Claim:
    """A new run, asked for and claimed at once: no supervisor can come between."""
    known = config.catalogue_entry
    title = known.title if method is None else f"{known.title} · {method}"
    with database.write() as session:
        run = request_run(session, config, title=title, goal=known.goal, preset=preset, method=method)
        return claim(session, run, "foreground", now=utc_now())


def _given(database: Database, run_id: str) -> int:
    """Answers as the budget counts them."""
    with database.read() as session:
        return feedback_progress(session, get_run(session, run_id)).given


def _result(
    database: Database, run_id: str, state: RunState | None, measures: Mapping[str, float]
) -> dict[str, Any]:
    """What came of the attempt; where the run was taken from it, how that stands now."""
    with database.read() as session:
        run = get_run(session, run_id)
        counted = feedback_progress(session, run)
    return {
        "run": run_id,
        "state": (state or run.state).value,
        "steps": run.step,
        "answers": counted.preferences,
        "return": measures.get("return"),
        "measures": {name: value for name, value in measures.items() if name != "return"},
        "error": run.error if state else TAKEN,
    }


def _say(console: Console, result: Mapping[str, Any]) -> None:
    console.print(
        f"{result['state'].capitalize()} at step {result['steps']:,} with {result['answers']} answers."
    )
    if result["return"] is not None:
        measures = "".join(f", {name} {value:.3g}" for name, value in result["measures"].items())
        console.print(f"Return of the last evaluation: {result['return']:.1f}{measures}")
    if result["error"]:
        console.print(result["error"], style="red")
    else:
        console.print(f"`pebble evaluate {result['run']}` evaluates it again.")


class _display:  # noqa: N801  (used as a context manager only)
    """A line with phase, steps, rate, answers and time left, drawn from a thread of its own.

    `given` counts the answers that count; it is asked only when some have come or gone.
    """

    def __init__(self, attempt: Any, console: Console, config: RunConfig, given: Callable[[], int]) -> None:
        self.attempt, self.config, self.given = attempt, config, given
        self.ended = threading.Event()
        self.bar = Progress(
            TextColumn("{task.description:<14}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[rate]:>9}"),
            TextColumn("{task.fields[answers]}"),
            TimeRemainingColumn(),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )
        self.thread = threading.Thread(target=self._draw, daemon=True)

    def __enter__(self) -> None:
        self.bar.start()
        self.thread.start()

    def __exit__(self, *_: object) -> None:
        self.ended.set()
        self.thread.join()
        self.bar.stop()

    def _draw(self) -> None:
        task = self.bar.add_task("starting", total=self.config.total_steps, rate="", answers="")
        began, heard, answers = time.monotonic(), None, ""
        while not self.ended.wait(0.5):
            run = self.attempt.run
            if run is None:
                continue
            status, inbox = run.progress.status, run.progress.inbox
            rate = status.step / max(1e-9, time.monotonic() - began)
            if self.config.budget and inbox.sequence != heard:
                heard, answers = inbox.sequence, f"{self.given()} of {self.config.budget} answers"
            self.bar.update(
                task, completed=status.step, description=status.phase, rate=f"{rate:.0f}/s", answers=answers
            )
