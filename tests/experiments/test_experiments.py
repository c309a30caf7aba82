"""A whole small experiment: run, killed, run again, its results and every kind of figure."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from PIL import Image

from labels_db.data_folder import DataFolder
from labels_db.errors import ConflictError
from labels_db.experiments import Experiment, request_experiment, runs_of_experiment
from labels_db.models import EvaluationResult, RunState, utc_now
from labels_db.runs import stop_run
from tests.experiments.record import states
from trainer.experiments import provenance
from trainer.experiments.file import ExperimentError, read_experiment
from trainer.experiments.results import Results, write_results

SMALL = {
    "environment.action_repeat": 8,  # 125 steps an episode
    "agent.width": 16,
    "agent.batch_size": 16,
    "exploration.seed_steps": 130,
    "evaluation.every": 200,
    "evaluation.episodes": 1,
    "total_steps": 600,
}
ASKING = {
    "reward.width": 16,
    "reward.max_epochs": 2,
    "exploration.explore_steps": 170,
    "feedback.budget": 8,
    "feedback.queries_per_session": 4,
    "feedback.steps_between": 100,
}
SAYS: dict[str, Any] = {
    "name": "tiny",
    "title": "As small as it gets",
    "tasks": ["cartpole-swingup"],
    "methods": [{"method": "pebble", "name": "pebble-8", "settings": ASKING}, "sac"],
    "seeds": [1, 2],
    "settings": SMALL,
    "figures": [
        {"kind": "curves", "file": "curves"},
        {"kind": "curves", "file": "iqm", "statistic": "iqm", "asymptotes": ["sac"]},
        {"kind": "budgets", "file": "labels"},
        {"kind": "ends", "file": "ends", "published": {"cartpole-swingup": 824}},
        {"kind": "differences", "file": "claims", "pairs": [["pebble-8", "sac"]]},
        {"kind": "strips", "file": "strips", "frames": 4},
        {"kind": "queries", "file": "asked", "methods": ["pebble-8"], "sessions": [0], "queries": 2},
    ],
}


def written(folder: Path, **changes: Any) -> Path:
    path = folder / "tiny.yaml"
    path.write_text(yaml.safe_dump({**SAYS, **changes}), encoding="utf-8")
    return path


def pebble(*arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen([sys.executable, "-m", "cli", *arguments], stdout=subprocess.PIPE, text=True)


@pytest.fixture(scope="module")
def lived(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, DataFolder]:
    """The experiment, killed once in its middle without a word."""
    folder = tmp_path_factory.mktemp("experiment")
    file, data = written(folder), DataFolder(folder / "data")
    command = ["experiment", str(file), "--data", str(data.path), "--parallel", "2", "--json"]
    with pebble(*command) as killed:
        while RunState.FINISHED not in states(data, "tiny").values():
            assert killed.poll() is None
        os.kill(killed.pid, signal.SIGKILL)
    before = finished(data)
    with pebble(*command) as again:
        said, _ = again.communicate(timeout=120)
    assert again.returncode == 0, said
    assert '"finished": 4' in said
    assert before.items() <= finished(data).items()  # what had finished was not lived again
    return file, data


def finished(data: DataFolder) -> dict[str, tuple[int, Any]]:
    """When each finished run ended, and in which attempt."""
    database = data.open_database()
    with database.read() as session:
        runs = runs_of_experiment(session, "tiny")
        found = {run.id: (run.attempt, run.ended_at) for run in runs if run.state is RunState.FINISHED}
    database.close()
    return found


def test_every_run_is_lived_under_its_name(lived: tuple[Path, DataFolder]) -> None:
    _, data = lived
    assert set(states(data, "tiny").values()) == {RunState.FINISHED}
    database = data.open_database()
    with database.read() as session:
        runs = runs_of_experiment(session, "tiny")
        assert [run.id for run in runs] == [
            "tiny-cartpole-swingup-pebble-8-1",
            "tiny-cartpole-swingup-pebble-8-2",
            "tiny-cartpole-swingup-sac-1",
            "tiny-cartpole-swingup-sac-2",
        ]
        assert {run.method for run in runs} == {"pebble-8", "sac"}
    database.close()


def test_results_are_parquet_beside_configuration_and_versions(lived: tuple[Path, DataFolder]) -> None:
    _, data = lived
    folder = data.path / "experiments" / "tiny"
    results = Results.read(folder, Experiment.model_validate(SAYS))
    fewer = Results.read(folder, Experiment.model_validate({**SAYS, "seeds": [2]}))
    assert set(fewer.curves("cartpole-swingup", "sac", "return")) == {
        2
    }  # what is planned no more is left out
    curves = results.curves("cartpole-swingup", "sac", "return")
    assert {seed: [step for step, _ in curve] for seed, curve in curves.items()} == {
        1: [200, 400, 600],
        2: [200, 400, 600],
    }
    assert results.answers("cartpole-swingup", "pebble-8") == 8
    assert results.answers("cartpole-swingup", "sac") == 0
    assert results.last("cartpole-swingup", "sac", "return") == {s: c[-1][1] for s, c in curves.items()}
    kept = Experiment.model_validate_json((folder / "experiment.json").read_text())
    assert kept == Experiment.model_validate(SAYS)
    first, second = json.loads((folder / "configurations.json").read_text()).values()
    assert (first["feedback"]["budget"], second["agent"]["width"]) == (8, 16)
    (versions,) = json.loads((folder / "versions.json").read_text())
    assert {"since", "torch", "pebble-teach"} <= set(versions)


def test_versions_are_kept_with_the_moment_since_which_they_had_a_part(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    experiment, data = Experiment.model_validate(SAYS), DataFolder(tmp_path)
    for torch in ("1", "1", "2"):
        monkeypatch.setattr(provenance, "versions", lambda torch=torch: {"torch": torch})
        provenance.write_versions(experiment, data)
    kept = json.loads((tmp_path / "experiments" / "tiny" / "versions.json").read_text())
    assert [one["torch"] for one in kept] == ["1", "2"]
    assert kept[0]["since"] <= kept[1]["since"]


def test_versions_say_which_code_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a checkout: its commit, and whether files differ from it."""

    def git(*arguments: str) -> str:
        command = [
            "git",
            "-c",
            "user.name=T",
            "-c",
            "user.email=t@example.org",
            "-C",
            str(tmp_path),
            *arguments,
        ]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()

    monkeypatch.setattr(provenance, "CHECKOUT", tmp_path)
    assert "commit" not in provenance.versions()
    git("init")
    (tmp_path / "code.py").write_text("1", encoding="utf-8")
    git("add", "code.py")
    git("commit", "-m", "One")
    commit = git("rev-parse", "--short", "HEAD")
    assert provenance.versions()["commit"] == commit
    (tmp_path / "code.py").write_text("2", encoding="utf-8")
    assert provenance.versions()["commit"] == f"{commit}-dirty"


def test_every_kind_of_figure_is_drawn(lived: tuple[Path, DataFolder], tmp_path: Path) -> None:
    file, data = lived
    folder = data.path / "experiments" / "tiny"
    kept = {path.name: path.read_bytes() for path in folder.glob("*.json")}
    changed = written(tmp_path, settings={**SMALL, "total_steps": 700})
    with pebble("experiment", str(changed), "--data", str(data.path)) as refused:
        refused.communicate(timeout=60)
    assert refused.returncode != 0
    assert kept == {path.name: path.read_bytes() for path in folder.glob("*.json")}  # of what was run
    with pebble("plot", str(file), "--data", str(data.path), "--out", str(tmp_path)) as plotting:
        said, _ = plotting.communicate(timeout=120)
    assert plotting.returncode == 0
    names = ["curves.png", "iqm.png", "labels.png", "ends.md", "claims.md", "strips.png", "asked.png"]
    assert [Path(line).name for line in said.split()] == names
    for name in names:
        if name.endswith(".png"):
            pixels = np.asarray(Image.open(tmp_path / name).convert("L"))
            assert pixels.min() < 100 < 200 < pixels.max(), name
    assert "| pebble-8 − sac | 600 / 600 | 8 / 0 | 2 |" in (tmp_path / "claims.md").read_text()
    assert "| cartpole-swingup | pebble-8 | 600 | 8 |" in (tmp_path / "ends.md").read_text()


def test_other_settings_under_the_same_name_are_refused(lived: tuple[Path, DataFolder]) -> None:
    _, data = lived
    other = Experiment.model_validate({**SAYS, "settings": {**SMALL, "total_steps": 700}})
    database = data.open_database()
    with (
        pytest.raises(ConflictError, match="is there already, with other settings; give the experiment"),
        database.write() as session,
    ):
        request_experiment(session, other)
    database.close()


def test_what_was_stopped_is_asked_for_again(tmp_path: Path) -> None:
    database = DataFolder(tmp_path).open_database()
    experiment = Experiment.model_validate(SAYS)
    with database.write() as session:
        first = request_experiment(session, experiment)[0]
        stop_run(session, first.id)
        assert first.state is RunState.STOPPED
        assert request_experiment(session, experiment)[0].state is RunState.QUEUED
    database.close()


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"title": ""}, "title: .*at least 1 character"),
        ({"tasks": ["cartpole-swingdown"]}, "tasks: .*unknown; one of cartpole-swingup"),
        ({"methods": ["peble"]}, "method 'peble': unknown; did you mean pebble"),
        ({"seeds": []}, "seeds: .*at least 1 item"),
        ({"settings": {"agent.widht": 3}}, "tiny-cartpole-swingup-pebble-8-1: agent.widht: "),
        ({"colour": "red"}, "colour: Extra inputs"),
        ({"methods": ["sac"]}, "figure 'claims': no method 'pebble-8'; one of sac"),
        ({"name": "Not a name"}, "name: "),
        ({"by_task": {"walker-walk": {}}}, "by_task: no task 'walker-walk'; one of cartpole-swingup"),
        (
            {"figures": [{"kind": "strips", "file": "a"}, {"kind": "curves", "file": "a"}]},
            "figure 'a.png': is there 2 times",
        ),
        ({"seeds": [1, 2, 1]}, "seed 1: is there 2 times"),
        ({"methods": ["sac", "pebble", "sac"]}, "method 'sac': is there 2 times"),
        (
            {"figures": [{"kind": "curves", "file": "a", "tasks": ["walker-walk"]}]},
            "figure 'a': no task 'walker-walk'; one of cartpole-swingup",
        ),
        (
            {
                "tasks": ["cartpole-swingup", "reacher-easy"],
                "methods": [
                    {"method": "sac", "name": "sac", "tasks": ["reacher-easy"]},
                    {"method": "pebble", "name": "pebble-8", "tasks": ["cartpole-swingup"]},
                ],
            },
            "figure 'claims': pebble-8 and sac are run on no task in common",
        ),
        (
            {"methods": [{"method": "sac", "name": "sac", "tasks": ["walker-walk"]}], "figures": []},
            "method 'sac': no task 'walker-walk'",
        ),
    ],
)
def test_a_wrong_file_is_told_what_is_wrong(tmp_path: Path, changes: Any, complaint: str) -> None:
    with pytest.raises(ExperimentError, match=complaint):
        read_experiment(written(tmp_path, **changes))


def test_a_missing_or_broken_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ExperimentError, match=r"absent\.yaml: cannot be read"):
        read_experiment(tmp_path / "absent.yaml")
    (tmp_path / "broken.yaml").write_text("a: [")
    with pytest.raises(ExperimentError, match=r"broken\.yaml: is not YAML"):
        read_experiment(tmp_path / "broken.yaml")


def test_results_hold_every_task_s_own_measures(tmp_path: Path) -> None:
    data, experiment = (
        DataFolder(tmp_path),
        Experiment.model_validate({**SAYS, "methods": ["sac"], "figures": []}),
    )
    database = data.open_database()
    with database.write() as session:
        for run, measures in zip(request_experiment(session, experiment), ({}, {"turns": 3.0}), strict=True):
            session.add(
                EvaluationResult(
                    run_id=run.id, step=1, returns=[1.0], mean_return=1.0, measures=measures, at=utc_now()
                )
            )
    database.close()
    results = Results.read(write_results(experiment, data), experiment)
    assert results.curves("cartpole-swingup", "sac", "turns") == {2: [(1, 3.0)]}


def test_methods_may_have_settings_for_a_task_and_keep_to_some() -> None:
    compared = {"method": "sac", "name": "sac", "by_task": {"walker-walk": {"agent.width": 32}}}
    only = {"method": "pebble", "name": "pebble", "settings": ASKING, "tasks": ["walker-walk"]}
    tasks = ["cartpole-swingup", "walker-walk"]
    of_tasks = {"walker-walk": {"agent.width": 64, "total_steps": 900}}
    says = {
        **SAYS,
        "tasks": tasks,
        "methods": [compared, only],
        "figures": [],
        "seeds": [1],
        "by_task": of_tasks,
    }
    planned = {one.run_id: one.config for one in Experiment.model_validate(says).planned()}
    assert set(planned) == {
        "tiny-cartpole-swingup-sac-1",
        "tiny-walker-walk-sac-1",
        "tiny-walker-walk-pebble-1",
    }
    widths = [planned[f"tiny-{task}-sac-1"].agent.width for task in tasks]
    assert widths == [16, 32]  # the method's own come last
    assert [planned[f"tiny-{task}-sac-1"].total_steps for task in tasks] == [600, 900]


def test_seeds_of_an_experiment_are_those_of_its_runs() -> None:
    planned = list(Experiment.model_validate(SAYS).planned())
    assert [one.config.seed for one in planned] == [1, 1, 2, 2]


def test_any_environment_is_a_task_by_its_name() -> None:
    says = {**SAYS, "tasks": ["gym:Hopper-v5", "metaworld:push"], "figures": []}
    planned = list(Experiment.model_validate(says).planned())
    assert {one.config.environment.name for one in planned} == set(says["tasks"])
    assert planned[0].run_id.startswith("tiny-gym-Hopper-v5-")
