"""An experiment lived through in two places, each of which knows the other by its results alone."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml

from labels_db.data_folder import DataFolder
from labels_db.experiments import Experiment, request_experiment
from labels_db.models import RunState
from tests.experiments.record import states
from trainer.experiments.file import ExperimentError
from trainer.experiments.joining import join_results
from trainer.experiments.provenance import kept_versions
from trainer.experiments.results import Results
from trainer.experiments.runner import ExperimentRuns, run_experiment

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


def lived(experiment: Experiment, data: DataFolder) -> ExperimentRuns:
    """Lived through here to its end."""
    return run_experiment(experiment, data, parallel=1, leave=threading.Event(), show=lambda _: None)


@pytest.fixture(scope="module")
def there(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of the first seed, lived through on a machine that is gone."""
    folder = tmp_path_factory.mktemp("there")
    data = DataFolder(folder / "data")
    assert lived(saying(seeds=[1]), data).finished == 1
    shutil.move(results_of(data), folder / "results")
    shutil.rmtree(data.path)
    return folder / "results"


def results_of(data: DataFolder) -> Path:
    return data.path / "experiments" / "parts"


def copied(there: Path, to: Path, alter: Callable[[dict[str, Any]], dict[str, Any]]) -> Path:
    """Results as another machine might have them."""
    shutil.copytree(there, to)
    rows = pq.read_table(there / "results.parquet").to_pylist()
    pq.write_table(pa.Table.from_pylist([{**row, **alter(row)} for row in rows]), to / "results.parquet")
    return to


def of_seed(seed: int, **changes: Any) -> Callable[[dict[str, Any]], dict[str, Any]]:
    def altered(row: dict[str, Any]) -> dict[str, Any]:
        config = json.dumps({**json.loads(row["config"]), "seed": seed})
        return {"run": f"parts-cartpole-swingup-sac-{seed}", "seed": seed, "config": config, **changes}

    return altered


def test_what_finished_elsewhere_is_not_lived_again_and_counts(there: Path, tmp_path: Path) -> None:
    file, data = tmp_path / "parts.yaml", DataFolder(tmp_path / "data")
    file.write_text(yaml.safe_dump(SAYS), encoding="utf-8")
    said = pebble("experiment", file, "--data", data.path, "--join", there, "--json")
    assert json.loads(said).items() >= {"runs": 2, "finished": 2, "joined": 1}.items()
    assert set(states(data, "parts")) == {"parts-cartpole-swingup-sac-2"}
    whole = Results.read(results_of(data), saying())
    assert whole.curves(*ASKED)[1] == Results.read(there, saying()).curves(*ASKED)[1]
    assert set(whole.last(*ASKED)) == {1, 2}
    pebble("plot", file, "--data", data.path, "--out", tmp_path)  # strips too, of the run that is here
    one, two = (f"{value:.1f}" for value in whole.last(*ASKED).values())
    assert f"{one}, {two}" in (tmp_path / "ends.md").read_text(encoding="utf-8")


def pebble(*arguments: object) -> str:
    command = [sys.executable, "-m", "cli", *map(str, arguments)]
    return subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, timeout=120).stdout


def test_what_has_finished_is_in_the_results_before_all_is_over(tmp_path: Path) -> None:
    """A machine may be gone without a word: what it had finished can be taken from it."""
    data, kept = DataFolder(tmp_path), []

    def look(now: ExperimentRuns) -> None:
        if now.finished == 1 and (results_of(data) / "results.parquet").exists():
            kept.append(set(Results.read(results_of(data), saying()).last(*ASKED)))

    run_experiment(saying(), data, parallel=1, leave=threading.Event(), show=look)
    assert {1} in kept


def test_what_waited_here_and_finished_elsewhere_is_not_lived(there: Path, tmp_path: Path) -> None:
    """As where this machine had begun with the first seed, and left the others to a second one."""
    data = DataFolder(tmp_path / "data")
    database = data.open_database()
    with database.write() as session:
        request_experiment(session, saying())
    database.close()
    join_results(saying(), data, [there, copied(there, tmp_path / "second", of_seed(2))])
    assert (now := lived(saying(), data)).finished == now.planned == now.joined == 2
    assert set(states(data, "parts").values()) == {RunState.STOPPED}
    assert set(Results.read(results_of(data), saying()).last(*ASKED)) == {1, 2}


def test_what_is_joined_stays_whatever_is_planned_meanwhile(there: Path, tmp_path: Path) -> None:
    """And a folder that only joined can itself be joined."""
    data = DataFolder(tmp_path / "data")
    join_results(saying(), data, [there, copied(there, tmp_path / "second", of_seed(2)), there])
    for seeds in ([2], [1, 2]):
        assert lived(saying(seeds=seeds), data).joined == len(seeds)
    assert states(data, "parts") == {}
    onward = DataFolder(tmp_path / "onward")
    join_results(saying(seeds=[2, 1]), onward, [results_of(data)])
    assert lived(saying(), onward).joined == 2
    last = Results.read(there, saying()).last(*ASKED)[1]
    assert Results.read(results_of(onward), saying()).last(*ASKED) == {1: last, 2: last}


def test_only_what_finished_is_joined(there: Path, tmp_path: Path) -> None:
    unfinished = copied(there, tmp_path / "unfinished", of_seed(1, state="running"))
    with pytest.raises(ExperimentError, match="unfinished: holds no finished run of experiment 'parts'"):
        join_results(saying(), DataFolder(tmp_path), [there, unfinished])
    assert not list(tmp_path.glob("experiments/*/*"))  # of the first folder neither


def test_a_run_that_finished_here_is_told_of_as_it_went_here(there: Path, tmp_path: Path) -> None:
    experiment, data = saying(seeds=[2]), DataFolder(tmp_path / "data")
    lived(experiment, data)
    here = Results.read(results_of(data), experiment).rows
    join_results(experiment, data, [copied(there, tmp_path / "other", of_seed(2, **{"return": -1.0}))])
    assert lived(experiment, data).joined == 0
    assert Results.read(results_of(data), experiment).rows == here


def test_versions_that_had_a_part_are_told_in_their_order(there: Path, tmp_path: Path) -> None:
    (theirs,) = kept_versions(there)
    older = copied(there, tmp_path / "older", of_seed(2))
    (older / "versions.json").write_text(json.dumps([{**theirs, "since": "2020", "torch": "1.0"}]))
    data = DataFolder(tmp_path / "data")
    join_results(saying(), data, [there, older])
    lived(saying(), data)
    assert [one["torch"] for one in kept_versions(results_of(data))] == ["1.0", theirs["torch"]]


def test_other_settings_are_not_joined(there: Path, tmp_path: Path) -> None:
    other, data = saying(settings={**SETTINGS, "agent.width": 32}), DataFolder(tmp_path)
    with pytest.raises(ExperimentError, match=r"sac-1 was run with other settings \(agent.width\); give"):
        join_results(other, data, [there])
    assert not list(data.path.glob("**/*.parquet"))


def test_settings_that_change_once_it_is_joined_are_refused(there: Path, tmp_path: Path) -> None:
    data = DataFolder(tmp_path)
    join_results(saying(), data, [there])
    with pytest.raises(
        ExperimentError, match=r"joined results: .*-1 was run with other settings \(total_steps\)"
    ):
        lived(saying(settings={**SETTINGS, "total_steps": 400}), data)
    assert states(data, "parts") == {}


@pytest.mark.parametrize("name", ["nothing", "foreign", "garbled"])
def test_what_is_no_folder_of_results_is_named(there: Path, tmp_path: Path, name: str) -> None:
    if name != "nothing":
        shutil.copytree(there, tmp_path / name)
    if name == "foreign":
        pq.write_table(pa.table({"a": [1]}), tmp_path / name / "results.parquet")
    if name == "garbled":
        (tmp_path / name / "versions.json").write_text("{}")
    with pytest.raises(ExperimentError, match=f"{name}: is no folder of results to join; give DATA/exp"):
        join_results(saying(), DataFolder(tmp_path / "data"), [tmp_path / name])
