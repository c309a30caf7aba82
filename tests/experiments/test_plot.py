"""`pebble plot`: what there is something to show of is drawn, and the rest is named with the reason."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml

from cli.errors import UsageError
from cli.experiment import plot
from labels_db import catalogue
from labels_db.catalogue import as_text, entry
from labels_db.data_folder import DataFolder
from labels_db.experiments import Experiment, request_experiment
from labels_db.models import RunState
from labels_db.records import evaluation

SAYS: dict[str, Any] = {
    "name": "two",
    "title": "Two",
    "tasks": ["cartpole-swingup"],
    "methods": ["sac"],
    "seeds": [1],
    "figures": [
        {"kind": "curves", "file": "success", "measure": "success"},
        {"kind": "ends", "file": "success", "measure": "success"},
        {"kind": "strips", "file": "strips"},
        {"kind": "ends", "file": "ends"},
    ],
}


@pytest.fixture(autouse=True)
def own_catalogues(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a test's data folder adds to the catalogue is forgotten after it."""
    monkeypatch.setattr(catalogue, "_included", set())


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    """Results of one finished run."""
    (planned,) = Experiment.model_validate(SAYS).planned()
    known = {"run": planned.run_id, "task": "cartpole-swingup", "method": "sac", "seed": 1, "step": 400}
    row = {**known, "total_steps": 400, "state": "finished", "return": 7.0, "answers": 0}
    pq.write_table(pa.Table.from_pylist([row]), tmp_path / "results.parquet")
    return tmp_path


def plotted(kept: Path, figures: list[dict[str, Any]]) -> None:
    file = kept / "two.yaml"
    file.write_text(yaml.safe_dump({**SAYS, "figures": figures}), encoding="utf-8")
    plot(file, DataFolder(kept / "data"), kept / "figures", kept)


def test_figures_with_nothing_to_show_are_named_and_the_others_drawn(
    kept: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plotted(kept, SAYS["figures"])
    said = capsys.readouterr()
    assert said.out.split() == [str(kept / "figures" / "ends.md")]
    assert said.err.splitlines() == [
        "success.png: skipped, no run has an evaluation with the measure 'success' yet",
        "success.md: skipped, no finished run has the measure 'success' yet",
        "strips.png: skipped, it is drawn from the runs themselves",
    ]
    assert [path.name for path in (kept / "figures").iterdir()] == ["ends.md"]


def test_it_fails_where_nothing_at_all_is_drawn(kept: Path) -> None:
    with pytest.raises(UsageError, match=r"two.yaml: none of its figures could be drawn"):
        plotted(kept, SAYS["figures"][:3])
    with pytest.raises(UsageError, match=r"two.yaml: asks for no figures; add some under `figures:`"):
        plotted(kept, [])


GONE = "gym:gone/Cart-v0"
OF_RUNS: list[dict[str, Any]] = [
    {"kind": "strips", "file": "strips"},
    {"kind": "queries", "file": "asked"},
    {"kind": "ends", "file": "ends"},
]


def lived(data: DataFolder, task: str, **environment: str) -> None:
    """One finished run in the record, which says that it lived in another environment than the task's."""
    experiment = Experiment.model_validate({**SAYS, "tasks": [task], "figures": []})
    with data.open_database() as database, database.write() as session:
        (run,) = request_experiment(session, experiment)
        run.state = RunState.FINISHED
        run.config = {**run.config, "environment": {**run.config["environment"], **environment}}
        session.add(evaluation(run.id, step=400, returns=[7.0], measures={}))


def plotted_here(data: DataFolder, task: str) -> None:
    file = data.path / "two.yaml"
    file.write_text(yaml.safe_dump({**SAYS, "tasks": [task], "figures": OF_RUNS}), encoding="utf-8")
    plot(file, data, data.path / "figures")


def test_runs_in_an_environment_that_is_installed_no_more_are_not_drawn(
    data: DataFolder, capsys: pytest.CaptureFixture[str]
) -> None:
    known = dataclasses.replace(entry("gym:Hopper-v5"), name=GONE, title="Cart")
    data.catalogue_path.write_text(as_text([known]), encoding="utf-8")
    lived(data, GONE)
    plotted_here(data, GONE)
    said = capsys.readouterr()
    assert said.out.split() == [str(data.path / "figures" / "ends.md")]
    strips, asked = said.err.splitlines()
    reason = f"skipped, its environment cannot be made here any more: {GONE}: Namespace gone not found."
    assert strips.startswith(f"strips.png: {reason}")
    assert asked.startswith(f"asked.png: {reason}")


def test_runs_in_an_environment_that_the_catalogue_has_lost_are_not_drawn(
    data: DataFolder, capsys: pytest.CaptureFixture[str]
) -> None:
    lived(data, "gym:Hopper-v5", id="gone/Cart-v0")
    plotted_here(data, "gym:Hopper-v5")
    said = capsys.readouterr()
    assert said.out.split() == [str(data.path / "figures" / "ends.md")]
    strips, asked = said.err.splitlines()
    assert strips.startswith(f"strips.png: skipped, {GONE} is not among the environments here any more")
    assert f"`pebble environments --add {GONE}` brings it back" in asked


def test_a_policy_that_cannot_be_read_is_not_drawn(
    data: DataFolder, capsys: pytest.CaptureFixture[str]
) -> None:
    lived(data, "gym:Hopper-v5")
    plotted_here(data, "gym:Hopper-v5")
    said = capsys.readouterr()
    assert said.out.split() == [str(data.path / "figures" / "ends.md")]
    strips, asked = said.err.splitlines()
    assert strips.startswith("strips.png: skipped, run two-gym-Hopper-v5-sac-1: has no checkpoint yet")
    assert asked == "asked.png: skipped, no run here has anything to show yet"
