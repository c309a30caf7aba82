"""`pebble plot`: what there is something to show of is drawn, and the rest is named with the reason."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml

from cli.errors import UsageError
from cli.experiment import plot
from labels_db.data_folder import DataFolder
from labels_db.experiments import Experiment

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
