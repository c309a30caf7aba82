"""Figures that are tables, cell by cell."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from labels_db.data_folder import DataFolder
from labels_db.experiments import Experiment, request_experiment
from labels_db.figures import Differences, Ends, Strips
from labels_db.models import RunState
from trainer.evaluation import EvaluatedEpisode
from trainer.experiments import figures
from trainer.experiments.drawing import Drawing
from trainer.experiments.pictures import Row, _came_to
from trainer.experiments.results import Results
from trainer.experiments.tables import differences, ends

SAYS = {
    "name": "two",
    "title": "Two",
    "tasks": ["cartpole-swingup"],
    "methods": ["sac", "pebble"],
    "seeds": [1],
}


def finished(method: str, returns: Iterable[float], answers: int = 0) -> list[dict[str, Any]]:
    """A row for each seed's end."""
    row = {
        "task": "cartpole-swingup",
        "method": method,
        "step": 400,
        "total_steps": 1400,
        "state": "finished",
    }
    return [
        {**row, "seed": seed, "return": value, "answers": answers}
        for seed, value in enumerate(returns, start=1)
    ]


def drawing(rows: list[dict[str, Any]], folder: Path) -> Drawing:
    experiment = Experiment.model_validate({**SAYS, "seeds": [1, 2, 3]})
    return Drawing(experiment, Results(rows), DataFolder(folder), folder)


def lived_here(folder: Path, seeds: list[int]) -> None:
    """The data folder has these runs, finished; what results know of others was joined."""
    database = DataFolder(folder).open_database()
    with database.write() as session:
        for run in request_experiment(session, Experiment.model_validate({**SAYS, "seeds": seeds})):
            run.state = RunState.FINISHED
    database.close()


def cells(path: Path) -> list[list[str]]:
    """Head and rows, without the line between them."""
    lines = path.read_text(encoding="utf-8").splitlines()
    assert set(lines[1]) <= set("| -")
    return [[cell.strip() for cell in line.split("|")[1:-1]] for line in (lines[0], *lines[2:])]


def test_ends_are_each_method_s_with_steps_answers_and_share(tmp_path: Path) -> None:
    rows = finished("sac", [100, 0, 40, 60, 50]) + finished("pebble", [30], answers=8)
    rows.append({**rows[0], "seed": 9, "state": "running", "return": 1000.0})
    figure = Ends(file="ends", published={"cartpole-swingup": 200})
    head, sac, pebble = cells(ends(figure, drawing(rows, tmp_path)))
    assert head == ["task", "method", "steps", "answers", "seeds", "IQM", "95 % interval", "of published"]
    middle = "100.0, 0.0, 40.0, 60.0, 50.0"  # less the highest and the lowest
    assert sac[:6] == ["cartpole-swingup", "sac", "1,400", "0", middle, "50.0"]
    low, high = map(float, sac[6].split(" … "))
    assert 0 <= low < 50 < high <= 100
    assert sac[7] == "25.0% of 200"
    assert pebble[3:] == ["8", "30.0", "30.0", "–", "15.0% of 200"]


def test_a_figure_keeps_to_its_tasks(tmp_path: Path) -> None:
    rows = [*finished("sac", [1]), {**finished("sac", [2])[0], "task": "reacher-easy"}]
    says = Experiment.model_validate({**SAYS, "tasks": ["cartpole-swingup", "reacher-easy"]})
    both = Drawing(says, Results(rows), DataFolder(tmp_path), tmp_path)
    _, row = cells(ends(Ends(file="ends", tasks=["reacher-easy"]), both))
    assert row[0] == "reacher-easy"


def test_the_best_run_is_so_by_the_figure_s_measure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[Row] = []
    monkeypatch.setattr(figures, "strips", lambda rows, *_: shown.extend(rows))
    lived_here(tmp_path, seeds=[1, 2])  # the third seed's run is not here
    rows = finished("sac", [9, 3, 99]) + finished("pebble", [5, 6])
    for row in rows:
        row["turns"] = -row["return"] if row["method"] == "sac" else None
    for settings in (
        {},
        {"measure": "turns"},
        {"measure": "turns", "best_by": {"cartpole-swingup": "return"}},
    ):
        figures.frame_strips(Strips.model_validate({"file": "strips", **settings}), drawing(rows, tmp_path))
    assert [(row.run_id, row.title.split(" · ")[-1], row.best_by) for row in shown] == [
        ("two-cartpole-swingup-sac-1", "sac, seed 1: return 9", "return"),
        ("two-cartpole-swingup-pebble-2", "pebble, seed 2: return 6", "return"),
        ("two-cartpole-swingup-sac-2", "sac, seed 2: turns -3", "turns"),
        ("two-cartpole-swingup-sac-1", "sac, seed 1: turns -9", "return"),
        ("two-cartpole-swingup-pebble-2", "pebble, seed 2", "return"),
    ]


def test_pairs_that_never_meet_on_a_task_are_left_out(tmp_path: Path) -> None:
    swings = {"method": "pebble", "name": "pebble", "tasks": ["cartpole-swingup"]}
    tasks = ["cartpole-swingup", "reacher-easy"]
    says = Experiment.model_validate({**SAYS, "tasks": tasks, "methods": ["sac", swings]})
    figure = Differences(file="claims", pairs=[("pebble", "sac")])
    _, *rows = cells(differences(figure, Drawing(says, Results([]), DataFolder(tmp_path), tmp_path)))
    assert [row[0] for row in rows] == ["cartpole-swingup"]


def test_an_episode_came_to_its_return_or_to_a_measure() -> None:
    episode = EvaluatedEpisode(seed=1, true_return=3.0, measures={"turns": 7.0}, states=np.empty((0, 1)))
    assert [_came_to(episode, measure) for measure in ("return", "turns")] == [3.0, 7.0]


def test_rates_keep_two_digits(tmp_path: Path) -> None:
    rows = finished("sac", [0.25, 0.31]) + finished("pebble", [0.5, 0.44])
    _, sac, _ = cells(ends(Ends(file="ends"), drawing(rows, tmp_path)))
    assert sac[4:6] == ["0.25, 0.31", "0.28"]
    figure = Differences(file="claims", pairs=[("pebble", "sac")])
    _, row = cells(differences(figure, drawing(rows, tmp_path)))
    assert row[5] == "+0.19"


def test_an_interval_takes_three_seeds(tmp_path: Path) -> None:
    """Resampled ones: of two they would be the two. Student's knows how little two say, and is kept."""
    rows = finished("sac", [10, 20]) + finished("pebble", [11, 12, 13])
    _, sac, pebble = cells(ends(Ends(file="ends"), drawing(rows, tmp_path)))
    assert (sac[6], pebble[6]) == ("–", "11.0 … 13.0")
    figure = Differences(file="claims", pairs=[("pebble", "sac")])
    _, row = cells(differences(figure, drawing(rows, tmp_path)))
    assert row[5:7] == ["-3.5", "-60.7 … +53.7"]  # 12.706 · 4.5


def test_without_published_figures_there_is_no_share(tmp_path: Path) -> None:
    head, row = cells(ends(Ends(file="ends"), drawing(finished("sac", [1, 2]), tmp_path)))
    assert (len(head), len(row), head[-1]) == (7, 7, "95 % interval")


def test_differences_are_paired_by_seed_and_say_undecided(tmp_path: Path) -> None:
    """By hand: 10, 20, 30 have mean 20 and standard error 10/√3; t(0.975, 2) = 4.3027."""
    rows = finished("sac", [100, 100, 100]) + finished("pebble", [110, 120, 130, 999], answers=8)
    figure = Differences(file="claims", pairs=[("pebble", "sac"), ("sac", "pebble")])
    _, up, down = cells(differences(figure, drawing(rows, tmp_path)))
    both = "1,400 / 1,400"
    assert up[1:5] == ["pebble − sac", both, "8 / 0", "3"]
    assert up[5:] == ["+20.0", "-4.8 … +44.8", "undecided", "120%"]
    assert down[1:5] == ["sac − pebble", both, "0 / 8", "3"]
    assert down[5:] == ["-20.0", "-44.8 … +4.8", "undecided", "83%"]


def test_a_share_of_the_other_may_be_compared_with(tmp_path: Path) -> None:
    rows = finished("sac", [100, 110]) + finished("pebble", [98, 107])
    figure = Differences(file="claims", pairs=[("pebble", "sac")], share=0.9)
    _, row = cells(differences(figure, drawing(rows, tmp_path)))
    assert [row[1], *row[4:6], row[8]] == ["pebble − 0.9 · sac", "2", "+8.0", "98%"]


def test_a_difference_of_one_seed_says_what_is_missing(tmp_path: Path) -> None:
    figure = Differences(file="claims", pairs=[("pebble", "sac")])
    rows = finished("sac", [1]) + finished("pebble", [2])
    _, row = cells(differences(figure, drawing(rows, tmp_path)))
    assert row[5:] == ["–", "–", "a paired difference needs two seeds that both methods have, not 1", "–"]
