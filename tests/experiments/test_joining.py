"""An experiment lived through in two places, each of which knows the other by its results alone."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest
import yaml

from labels_db.data_folder import DataFolder
from labels_db.experiments import Experiment, runs_of_experiment
from trainer.experiments.file import ExperimentError
from trainer.experiments.joining import join_results
from trainer.experiments.results import Results, write_results
from trainer.experiments.runner import Standing, run_experiment

SETTINGS = {
    "environment.action_repeat": 8,
    "agent.width": 16,
    "agent.batch_size": 16,
    "exploration.seed_steps": 130,
    "evaluation.every": 150,
    "evaluation.episodes": 1,
    "total_steps": 300,
}
SAYS: dict[str, Any] = {
    "name": "parts",
    "title": "One seed here, one there",
    "tasks": ["cartpole-swingup"],
    "methods": ["sac"],
    "seeds": [1, 2],
    "settings": SETTINGS,
    "figures": [{"kind": "ends", "file": "ends"}, {"kind": "strips", "file": "strips", "frames": 2}],
}


ASKED = ("cartpole-swingup", "sac", "return")


def saying(**changes: Any) -> Experiment:
    return Experiment.model_validate({**SAYS, **changes})


def lived(experiment: Experiment, data: DataFolder) -> Standing:
    """Lived through here to its end, its results written."""
    standing = run_experiment(experiment, data, parallel=1, leave=threading.Event(), show=lambda _: None)
    write_results(experiment, data)
    return standing


def run_ids(data: DataFolder) -> list[str]:
    database = data.open_database()
    with database.read() as session:
        found = [run.id for run in runs_of_experiment(session, "parts")]
    database.close()
    return found


def versions(results: Path) -> Any:
    return json.loads((results / "versions.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def there(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of the first seed, lived through on a machine that is gone."""
    folder = tmp_path_factory.mktemp("there")
    data = DataFolder(folder / "data")
    assert lived(saying(seeds=[1]), data).finished == 1
    shutil.move(data.path / "experiments" / "parts", folder / "results")
    shutil.rmtree(data.path)
    return folder / "results"


def test_what_finished_elsewhere_is_not_lived_again_and_counts(there: Path, tmp_path: Path) -> None:
    file, data = tmp_path / "parts.yaml", DataFolder(tmp_path / "data")
    file.write_text(yaml.safe_dump(SAYS), encoding="utf-8")
    said = pebble("experiment", file, "--data", data.path, "--join", there, "--json")
    assert json.loads(said).items() >= {"runs": 2, "finished": 2, "joined": 1}.items()
    assert run_ids(data) == ["parts-cartpole-swingup-sac-2"]
    whole = Results.read(data.path / "experiments" / "parts", saying())
    assert whole.curves(*ASKED)[1] == Results.read(there, saying()).curves(*ASKED)[1]
    assert set(whole.last(*ASKED)) == {1, 2}
    pebble("plot", file, "--data", data.path, "--out", tmp_path)  # strips too, of the run that is here
    one, two = (f"{value:.1f}" for value in whole.last(*ASKED).values())
    assert f"{one}, {two}" in (tmp_path / "ends.md").read_text(encoding="utf-8")


def pebble(*arguments: object) -> str:
    command = [sys.executable, "-m", "cli", *map(str, arguments)]
    return subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, timeout=120).stdout


def test_joined_results_and_their_versions_stay(there: Path, tmp_path: Path) -> None:
    experiment, data = saying(seeds=[1]), DataFolder(tmp_path)
    join_results(experiment, data, [there, there])
    for _ in range(2):
        join_results(experiment, data, [])
        assert lived(experiment, data).joined == 1
    assert run_ids(data) == []
    results = data.path / "experiments" / "parts"
    assert Results.read(results, experiment).rows == Results.read(there, experiment).rows
    assert versions(results) == versions(there)


def test_a_run_that_is_here_is_told_of_as_it_is_here(tmp_path: Path) -> None:
    experiment, data = saying(seeds=[2]), DataFolder(tmp_path)
    lived(experiment, data)
    join_results(experiment, data, [data.path / "experiments" / "parts"])
    assert lived(experiment, data).joined == 0
    rows = Results.read(data.path / "experiments" / "parts", experiment).rows
    assert [row["step"] for row in rows] == [150, 300]


def test_other_settings_are_not_joined(there: Path, tmp_path: Path) -> None:
    other, data = saying(settings={**SETTINGS, "agent.width": 32}), DataFolder(tmp_path)
    with pytest.raises(ExperimentError, match=r"sac-1 was run with other settings \(agent.width\)"):
        join_results(other, data, [there])
    assert not list(data.path.glob("**/*.parquet"))


def test_a_folder_without_results_is_named(tmp_path: Path) -> None:
    with pytest.raises(ExperimentError, match="empty: holds no results that could be joined"):
        join_results(saying(), DataFolder(tmp_path), [tmp_path / "empty"])
