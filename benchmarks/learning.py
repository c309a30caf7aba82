"""What the presets learn: `python -m benchmarks.learning windmill|swingup`, results in benchmarks/results/.

Each run is the command a user would type, with one thread; two run at a time on two cores. Runs that the
data folder holds already, finished and of the same configuration, are not lived again.
"""

from __future__ import annotations

import argparse
import json
import platform
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path
from typing import Any

import matplotlib as mpl
from sqlalchemy import select

from cli.train import chosen_config
from labels_db.data_folder import DataFolder
from labels_db.models import Run, RunState
from labels_db.records import evaluations_of, fits_of

RESULTS = Path(__file__).parent / "results"

WINDMILL = [
    ["cartpole-windmill-clockwise", "--teacher", "oracle", "--labels", "50", "--seed", str(seed)]
    for seed in (1, 2, 3)
] + [
    ["cartpole-windmill-counter-clockwise", "--teacher", "oracle", "--labels", "50", "--seed", str(seed)]
    for seed in (1, 2, 3)
]
TRUE_REWARD = ["--set=reward.kind=true", "--set=feedback.kind=none", "--set=exploration.kind=random"]
NO_VIDEO = "--set=evaluation.video=none"
SWINGUP = [
    ["cartpole-swingup", "--seed", str(seed), NO_VIDEO, *extra]
    for seed in (1, 2, 3)
    for extra in (["--labels", "200"], TRUE_REWARD)
]
EXPERIMENTS = {"windmill": WINDMILL, "swingup": SWINGUP}


def live(arguments: Sequence[str], data: Path) -> dict[str, Any]:
    """One run by the command line, unless there is one; its result and curve, from the record."""
    found = finished_run(arguments, data)
    if found is None:
        command = [sys.executable, "-m", "cli", "train", *arguments, "--json", "--data", str(data)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(f"{' '.join(arguments)}: {done.stderr}")
        found = finished_run(arguments, data)
    assert found is not None
    assert found.ended_at is not None
    minutes = (found.ended_at - found.created_at).total_seconds() / 60
    return {"command": "pebble train " + " ".join(arguments), "minutes": minutes, **curve(data, found.id)}


def finished_run(arguments: Sequence[str], data: Path) -> Run | None:
    """The run of that configuration, if the folder holds it."""
    given = parser_of_train().parse_args(list(arguments))
    config = chosen_config(
        given.preset,
        None,
        {"feedback.teacher.kind": given.teacher, "feedback.budget": given.labels, "seed": given.seed},
        given.set,
    )
    with DataFolder(data).open_database() as database, database.read() as session:
        runs = session.scalars(select(Run).where(Run.state == RunState.FINISHED)).all()
    return next((run for run in runs if run.config == config.model_dump(mode="json")), None)


def parser_of_train() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser()
    parser.add_argument("preset")
    for option in ("--teacher", "--labels", "--seed"):
        parser.add_argument(option)
    parser.add_argument("--set", action="append", default=[])
    return parser


def curve(data: Path, run_id: str) -> dict[str, Any]:
    """Evaluations and fits of the run, from its record."""
    with DataFolder(data).open_database() as database, database.read() as session:
        lived = [
            {"step": e.step, "return": e.mean_return, **e.measures} for e in evaluations_of(session, run_id)
        ]
        fits = [
            {"step": f.step, "answers": f.cursor, "training": f.training_accuracy, "fresh": f.fresh_accuracy}
            for f in fits_of(session, run_id)
        ]
    return {"evaluations": lived, "fits": fits}


def plot(name: str, rows: list[dict[str, Any]], measure: str) -> None:
    """The measure against steps, a line for each run."""
    mpl.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(7, 4), layout="constrained")
    for row in rows:
        points = [(e["step"], e[measure]) for e in row["evaluations"]]
        kind = (
            "true reward"
            if "reward.kind=true" in row["command"]
            else row["command"].split()[2].removeprefix("cartpole-")
        )
        seed = row["command"].split("--seed ")[1].split()[0]
        axes.plot(*zip(*points, strict=True), label=f"{kind}, seed {seed}", linewidth=1.5)
    axes.set(xlabel="steps of the agent", ylabel=measure)
    axes.legend(fontsize=8)
    figure.savefig(RESULTS / f"{name}.png", dpi=120)


def machine() -> dict[str, str]:
    packages = {package: version(package) for package in ("torch", "mujoco", "dm-control", "numpy")}
    return {
        "processor": platform.processor() or platform.machine(),
        "python": platform.python_version(),
        **packages,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("experiment", choices=EXPERIMENTS)
    parser.add_argument("--data", type=Path, default=Path("data/benchmarks"))
    parser.add_argument("--parallel", type=int, default=2)
    chosen = parser.parse_args()
    with ThreadPoolExecutor(chosen.parallel) as pool:
        rows = list(pool.map(lambda arguments: live(arguments, chosen.data), EXPERIMENTS[chosen.experiment]))
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"{chosen.experiment}.json"
    path.write_text(json.dumps({"machine": machine(), "runs": rows}, indent=1) + "\n", encoding="utf-8")
    plot(chosen.experiment, rows, {"windmill": "turns", "swingup": "return"}[chosen.experiment])
    for row in rows:
        print(f"{row['command']}: {row['evaluations'][-1]} in {row['minutes']:.1f} min")


if __name__ == "__main__":
    main()
