"""The `pebble` command as a person types it, in processes of its own."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from labels_db.data_folder import DataFolder
from labels_db.runs import get_run
from tests.trainer.conftest import SMALL


def pebble(
    *arguments: str, data: Path | None = None, timeout: float = 120
) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PEBBLE_DATA": str(data or "/nonexistent")}
    return subprocess.run(
        [sys.executable, "-m", "cli", *arguments],
        capture_output=True,
        text=True,
        env=environment,
        timeout=timeout,
        check=False,
    )


SETTINGS = [
    f"--set={path}={value}" for path, value in SMALL.items() if path not in ("total_steps", "feedback.budget")
]


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, object]]:
    data = tmp_path_factory.mktemp("cli")
    done = pebble(
        "train", "cartpole-windmill-clockwise", "--teacher", "oracle", "--labels", "8", "--steps", "700",
        "--seed", "3", "--json", *SETTINGS, data=data,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return data, json.loads(done.stdout.splitlines()[-1])


def test_train_ends_with_one_line_of_json(trained: tuple[Path, dict[str, object]]) -> None:
    _, result = trained
    assert (result["state"], result["steps"], result["answers"]) == ("finished", 700, 8)
    assert isinstance(result["return"], float)


def test_evaluate_export_replay_and_list(trained: tuple[Path, dict[str, object]], tmp_path: Path) -> None:
    data, result = trained
    run = str(result["run"])
    evaluated = pebble("evaluate", run, "--episodes", "1", "--json", data=data)
    assert json.loads(evaluated.stdout)["environment"] == "behaviour:cartpole-windmill-clockwise"
    exported = pebble("export-policy", run, str(tmp_path / "p.safetensors"), data=data)
    assert exported.returncode == 0, exported.stderr
    assert (tmp_path / "p.json").exists()
    replayed = pebble("replay", run, "--json", data=data)
    assert json.loads(replayed.stdout)["same"] is True, replayed.stdout
    assert replayed.returncode == 0
    listed = json.loads(pebble("runs", "--json", data=data).stdout)
    assert [row["run"] for row in listed] == [run]


@pytest.mark.parametrize("command", ["evaluate", "export-policy", "replay"])
def test_a_policy_whose_environment_is_gone_is_told_in_one_line(
    trained: tuple[Path, dict[str, object]], command: str, tmp_path: Path
) -> None:
    data = tmp_path / "data"
    shutil.copytree(trained[0], data)
    run = str(trained[1]["run"])
    with DataFolder(data).open_database() as database, database.write() as session:
        found = get_run(session, run)
        found.config = {**found.config, "environment": {"kind": "gym", "id": "gone/Cart-v0"}}
    file = [str(tmp_path / "p.onnx")] if command == "export-policy" else []
    told = pebble(command, run, *file, data=data)
    assert told.returncode == 2
    assert "`pebble environments --add gym:gone/Cart-v0` brings it back" in told.stderr
    assert "Traceback" not in told.stderr


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["train", "windmil"], "preset 'windmil': unknown; one of cartpole-windmill"),
        (["train", "walker-walk", "--profile", "phone"], "profile 'phone': walker-walk has laptop, paper"),
        (
            ["train", "walker-walk", "--teacher", "oracel"],
            "--teacher: 'oracel' is unknown; one of human, oracle",
        ),
        (["train", "walker-walk", "--set", "agent.widht=3"], "did you mean width?"),
        (["train", "walker-walk", "--set", "agent.width"], "must be PATH=VALUE"),
        (
            ["train", "walker-walk", "--set", "agent.width=1"],
            "--set agent.width: must be at least 8, not '1'",
        ),
        (["evaluate", "nobody"], "run 'nobody': not in this database"),
        (["label", "nobody", "--teacher", "oracel"], "--teacher 'oracel': unknown; one of oracle"),
        (["label", "nobody", "--url", "http://127.0.0.1:9"], "no server answers there"),
        (["healthy"], "no supervisor looks after it"),
    ],
)
def test_wrong_input_names_the_thing_the_value_and_the_way_out(
    arguments: list[str], complaint: str, tmp_path: Path
) -> None:
    done = pebble(*arguments, data=tmp_path)
    assert done.returncode == 2, done.stderr
    assert complaint in done.stderr
    assert "Traceback" not in done.stderr


def test_an_environment_is_added_and_trained_in(tmp_path: Path) -> None:
    added = pebble("environments", "--add", "gym:Hopper-v4", "--title", "Old hopper", data=tmp_path)
    assert added.returncode == 0, added.stderr
    assert "can end early" in added.stdout
    listed = {row["name"]: row for row in json.loads(pebble("environments", "--json", data=tmp_path).stdout)}
    assert listed["gym:Hopper-v4"]["title"] == "Old hopper"
    assert "dmc:walker-walk" in listed
    chosen = (
        "--set=environment.kind=gym",
        "--set=environment.id=Hopper-v4",
        "--set=feedback.segment_steps=1",
    )
    done = pebble("train", "cartpole-swingup", *SETTINGS, *chosen, "--steps=600", "--json", data=tmp_path)
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout.splitlines()[-1])
    assert result["answers"] > 0
    assert result["measures"]["seconds"] > 0
    assert "Episodes of gym:Hopper-v4 can end early" in done.stderr


def test_what_cannot_be_learned_in_is_not_added(tmp_path: Path) -> None:
    refused = pebble("environments", "--add", "gym:CartPole-v1", data=tmp_path)
    assert refused.returncode == 2
    assert refused.stderr.splitlines()[-1].startswith(
        "pebble: gym:CartPole-v1: takes actions from Discrete(2)"
    )


def test_presets_and_version() -> None:
    names = [row["name"] for row in json.loads(pebble("presets", "--json").stdout)]
    assert names == [
        "cartpole-windmill-clockwise",
        "cartpole-windmill-counter-clockwise",
        "quadruped-wave-left-front",
        "quadruped-wave-right-front",
        "hopper-backflip",
        "walker-walk-both-legs",
        "cartpole-swingup",
        "ball_in_cup-catch",
        "reacher-easy",
        "walker-walk",
        "cheetah-run",
        "quadruped-walk",
        "drawer-close",
        "window-open",
        "door-open",
        "button-press",
        "sweep-into",
        "drawer-open",
    ]
    assert pebble("--version").stdout.startswith("pebble ")


def test_doctor_finds_this_machine_well(tmp_path: Path) -> None:
    done = pebble("doctor", data=tmp_path)
    assert done.returncode == 0, done.stdout
    assert "drew a frame with" in done.stdout


def test_ctrl_c_stops_a_run_with_a_checkpoint(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "cli", "train", "cartpole-windmill-clockwise", "--teacher", "oracle"]
    command += ["--json", "--data", str(tmp_path), *SETTINGS, "--steps", "100000"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    ends = time.monotonic() + 90
    while not list((tmp_path / "artifacts").glob("runs/*/checkpoints/*.json")):
        assert time.monotonic() < ends
        time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=60)
    assert process.returncode == 0, errors
    assert json.loads(output.splitlines()[-1])["state"] == "stopped"
