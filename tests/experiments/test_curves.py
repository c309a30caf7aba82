"""Learning curves: whose line is drawn, how far, and from which runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import pytest

from labels_db.data_folder import DataFolder
from labels_db.experiments import Experiment
from labels_db.figures import Curves
from trainer.experiments import curves
from trainer.experiments.drawing import Drawing
from trainer.experiments.panels import NothingToShowError
from trainer.experiments.results import Results

SAYS: dict[str, Any] = {
    "name": "tiny",
    "title": "As small as it gets",
    "tasks": ["cartpole-swingup"],
    "methods": [{"method": "pebble", "name": "pebble-8"}, "sac"],
    "seeds": [1, 2],
}
SAID = Experiment.model_validate(SAYS)


def recorded(**changes: Any) -> dict[str, Any]:
    """A row of results."""
    row = {"task": "cartpole-swingup", "method": "sac", "seed": 1, "step": 200, "state": "finished"}
    return {**row, "return": 1.0, "answers": 0, "total_steps": 400, **changes}


def test_only_finished_runs_have_an_end() -> None:
    rows = [recorded(), recorded(step=400, **{"return": 3.0}), recorded(seed=2, state="running")]
    assert Results(rows).last("cartpole-swingup", "sac", "return") == {1: 3.0}
    assert set(Results(rows).curves("cartpole-swingup", "sac", "return")) == {1, 2}
    assert set(Results(rows).comparable("cartpole-swingup", "sac", "return")) == {1}
    assert set(Results(rows[2:]).comparable("cartpole-swingup", "sac", "return")) == {2}


def test_answers_and_steps_are_those_of_finished_runs() -> None:
    rows = [recorded(answers=200), recorded(seed=2, answers=20, total_steps=900, state="running")]
    assert Results(rows).answers("cartpole-swingup", "sac") == 200
    assert Results(rows).steps("cartpole-swingup", "sac") == 400


def drawn(figure: Curves, rows: list[dict[str, Any]], folder: Path, experiment: Experiment = SAID) -> Any:
    """The panels of a figure of curves."""
    mpl.use("Agg")
    drawing = Drawing(experiment, Results(rows), DataFolder(folder), folder)
    kept: list[Any] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(curves, "saved", lambda figure, _: kept.append(figure))
        curves.curves(figure, drawing)
    return kept[0].axes


def test_a_line_is_a_method_s_mean_and_an_asymptote_its_end(tmp_path: Path) -> None:
    rows = [recorded(step=s, seed=k, **{"return": float(s * k)}) for s in (200, 400) for k in (1, 3)]
    rows += [recorded(step=s, method="pebble-8", **{"return": 7.0}) for s in (200, 400, 900)]
    figure = Curves(file="a", methods=["sac"], asymptotes=["pebble-8"])
    (panel,) = drawn(figure, rows, tmp_path)
    line, asymptote = panel.get_lines()
    assert line.get_xydata().tolist() == [[200, 400], [400, 800]]
    assert set(asymptote.get_ydata()) == {7.0}


def test_a_method_may_have_a_line_and_an_asymptote(tmp_path: Path) -> None:
    """As PPO in the paper: the line ends with those of the others, the asymptote tells where it would."""
    rows = [recorded(step=s, **{"return": 1.0}) for s in (200, 400)]
    rows += [recorded(step=s, method="pebble-8", **{"return": s / 100}) for s in (200, 400, 4000)]
    figure = Curves(file="a", methods=["sac", "pebble-8"], asymptotes=["pebble-8"])
    (panel,) = drawn(figure, rows, tmp_path)
    _, line, asymptote = panel.get_lines()
    assert line.get_xydata().tolist() == [[200, 2], [400, 4]]
    assert set(asymptote.get_ydata()) == {40.0}


def test_a_task_that_has_not_begun_has_no_panel(tmp_path: Path) -> None:
    says = Experiment.model_validate({**SAYS, "tasks": ["walker-walk", "cartpole-swingup"]})
    (panel,) = drawn(Curves(file="a"), [recorded()], tmp_path, says)
    assert panel.get_title() == "Cart pole · swing up"


def test_an_empty_picture_is_refused(tmp_path: Path) -> None:
    with pytest.raises(NothingToShowError, match="no run has an evaluation with the measure 'succes' yet"):
        drawn(Curves(file="a", measure="succes"), [recorded()], tmp_path)
