"""`pebble experiment`, `pebble plot`, `pebble methods`."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from cli.errors import UsageError
from cli.foreground import leave_on_signals, log_to_stderr
from cli.tables import plain_console, table_of_names
from labels_db.data_folder import DataFolder
from labels_db.experiments import Experiment
from labels_db.methods import methods
from labels_db.models import ALIVE, Run


def list_methods(*, as_json: bool) -> None:
    """Every method, and what it is."""
    if as_json:
        rows = [{"name": m.name, "is": m.sentence, "settings": dict(m.settings)} for m in methods().values()]
        typer.echo(json.dumps(rows))
        return
    table = table_of_names("Method", "What it is")
    for method in methods().values():
        table.add_row(method.name, method.sentence)
    plain_console().print(table)


def live_through(file: Path, data: DataFolder, parallel: int, join: Sequence[Path], *, as_json: bool) -> int:
    """Run what is missing of the experiment; 0 unless a run failed. Ctrl-C stops with checkpoints."""
    from trainer.experiments.file import read_experiment
    from trainer.experiments.joining import join_results
    from trainer.experiments.results import results_folder
    from trainer.experiments.runner import run_experiment

    log_to_stderr()
    experiment = read_experiment(file)
    join_results(experiment, data, join)
    leave = leave_on_signals()
    with _display(experiment, hidden=as_json) as show:
        lived = run_experiment(experiment, data, parallel=parallel, leave=leave, show=show)
    folder = results_folder(experiment, data)
    result = {
        "experiment": experiment.name,
        "runs": lived.planned,
        "joined": lived.joined,
        "finished": lived.finished,
        "failed": lived.failed,
        "results": str(folder),
    }
    typer.echo(json.dumps(result) if as_json else _sentence(result))
    return 1 if lived.failed else 0


def plot(file: Path, data: DataFolder, out: Path | None, kept: Path | None = None) -> None:
    """Draw the experiment's figures from its results, or those that kept results are enough for."""
    from trainer.experiments.figures import draw_all
    from trainer.experiments.file import read_experiment
    from trainer.experiments.results import Results, write_results

    experiment = read_experiment(file)
    folder = kept or write_results(experiment, data)
    try:
        results = Results.read(folder, experiment)
    except FileNotFoundError as error:
        raise UsageError(f"{folder}: has no results yet; run `pebble experiment {file}`") from error
    if not experiment.figures:
        raise UsageError(f"{file}: asks for no figures; add some under `figures:`")
    drawable = [figure for figure in experiment.figures if not (kept and figure.of_runs)]
    drawn = 0
    for path, missing in draw_all(drawable, experiment, results, data, out or folder / "figures"):
        drawn += not missing
        typer.echo(f"{path.name}: skipped, {missing}" if missing else str(path), err=bool(missing))
    for figure in experiment.figures:
        if figure not in drawable:
            typer.echo(f"{figure.path}: skipped, it is drawn from the runs themselves", err=True)
    if not drawn:
        raise UsageError(f"{file}: none of its figures could be drawn")


def _sentence(result: dict[str, Any]) -> str:
    joined = f" ({result['joined']} of them elsewhere)" if result["joined"] else ""
    failed = f" Failed: {', '.join(result['failed'])}." if result["failed"] else ""
    return (
        f"{result['experiment']}: {result['finished']} of {result['runs']} runs finished{joined}.{failed}"
        f" Results in {result['results']}"
    )


@contextmanager
def _display(experiment: Experiment, *, hidden: bool) -> Iterator[Callable[[Any], None]]:
    """One line for the whole, and one for each run under way."""
    columns = (
        TextColumn("{task.description:<48}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]:>8}"),
        TimeRemainingColumn(),
    )
    console = plain_console(stderr=True)
    with Progress(*columns, console=console, disable=hidden or not console.is_terminal) as bars:
        whole = bars.add_task(experiment.name, total=None, rate="")
        lines: dict[str, TaskID] = {}

        def show(now: Any) -> None:
            bars.update(whole, total=now.planned, completed=now.finished)
            alive = {run.id: run for run in now.runs if run.state in ALIVE}
            for ended in lines.keys() - alive.keys():
                bars.remove_task(lines.pop(ended))
            for run in alive.values():
                _show_run(bars, lines, run)

        yield show


def _show_run(bars: Progress, lines: dict[str, TaskID], run: Run) -> None:
    if run.id not in lines:
        lines[run.id] = bars.add_task(run.id, total=run.config["total_steps"], rate="")
    rate = "" if run.steps_per_second is None else f"{run.steps_per_second:.0f}/s"
    bars.update(lines[run.id], completed=run.step, description=f"{run.id} {run.phase}", rate=rate)
