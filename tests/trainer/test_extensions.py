"""The example of docs/extending.md, installed as any package would be, and taught with."""

from __future__ import annotations

import importlib
import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from labels_db.data_folder import DataFolder
from labels_db.runs import get_run
from trainer.extensions import installed

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "docs" / "example"

SMALL = [
    "agent.width=8",
    "agent.batch_size=8",
    "reward.width=8",
    "reward.max_epochs=2",
    "reward.batch_size=8",
    "exploration.seed_steps=50",
    "exploration.explore_steps=60",
    "feedback.budget=8",
    "feedback.queries_per_session=4",
    "feedback.steps_between=40",
    "feedback.segment_steps=5",
    "evaluation.every=1000",
    "evaluation.episodes=1",
    "evaluation.video=none",
]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the example is installed: its module, and the entry points that an installer writes."""
    folder = tmp_path_factory.mktemp("site")
    (folder / "pebble_example.py").write_text((EXAMPLE / "pebble_example.py").read_text())
    project = tomllib.loads((EXAMPLE / "pyproject.toml").read_text())["project"]
    info = folder / f"pebble_example-{project['version']}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: pebble-example\nVersion: {project['version']}\n"
    )
    groups = [
        f"[{group}]\n" + "".join(f"{name} = {value}\n" for name, value in points.items())
        for group, points in project["entry-points"].items()
    ]
    (info / "entry_points.txt").write_text("\n".join(groups))
    return folder


def pebble(site: Path, *arguments: str) -> str:
    environment = {**os.environ, "PYTHONPATH": f"{site}{os.pathsep}{ROOT}"}
    command = [sys.executable, "-m", "cli", *arguments]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def taught(site: Path, data: Path, task: str, *settings: str) -> dict[str, Any]:
    options = [option for setting in (*SMALL, *settings) for option in ("--set", setting)]
    said = pebble(site, "train", task, "--steps", "260", "--data", str(data), "--json", *options)
    result: dict[str, Any] = json.loads(said.splitlines()[-1])
    return result


def test_an_environment_a_teacher_and_a_scheme_of_ones_own(site: Path, tmp_path: Path) -> None:
    added = pebble(site, "environments", "--add", "installed:corridor", "--data", str(tmp_path))
    assert "only scripted teachers can be asked" not in added  # it draws itself
    result = taught(
        site,
        tmp_path,
        "installed:corridor",
        "environment.action_repeat=2",
        "feedback.teacher.kind=installed",
        "feedback.teacher.name=impatient",
        "feedback.scheme.kind=installed",
        "feedback.scheme.name=undecided",
    )
    assert (result["state"], result["answers"]) == ("finished", 8)
    assert result["measures"].keys() == {"distance"}


def test_a_behaviour_of_ones_own(site: Path, tmp_path: Path) -> None:
    pebble(site, "environments", "--add", "behaviour:pendulum-hang", "--data", str(tmp_path))
    result = taught(
        site,
        tmp_path,
        "behaviour:pendulum-hang",
        "environment.action_repeat=16",
        "feedback.teacher.kind=oracle",
    )
    assert (result["state"], result["answers"]) == ("finished", 8)
    assert result["measures"].keys() == {"speed"}
    database = DataFolder(tmp_path).open_database()
    with database.read() as session:
        run = get_run(session, result["run"])
        assert run.title == "Pendulum · hang still"
        assert [card.text for card in run.goal_cards] == ["Prefer the clip in which the pendulum moves less."]
    database.close()


def test_the_documentation_shows_the_example_as_it_is() -> None:
    shown = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", shown, re.DOTALL)
    example = (EXAMPLE / "pebble_example.py").read_text(encoding="utf-8")
    assert len(blocks) == 4
    for block in blocks:
        assert block.strip() in example
    (offered,) = re.findall(r"```toml\n(.*?)```", shown, re.DOTALL)
    project = tomllib.loads((EXAMPLE / "pyproject.toml").read_text())["project"]
    assert tomllib.loads(offered)["project"]["entry-points"] == project["entry-points"]


def test_an_environment_of_ones_own_can_be_drawn(site: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(site))
    corridor = importlib.import_module("pebble_example").Corridor(action_repeat=2)
    corridor.reset(seed=1)
    scene = corridor.scene
    pictures = []
    for place in (-2.0, 0.0, 2.0, 99.0):
        scene.restore(1, np.array([place, 0.0]))
        pictures.append(scene.picture())
    dark = [np.flatnonzero((picture < 100).all(2).any(0)).mean() for picture in pictures[:3]]
    assert dark == pytest.approx([80, 160, 240], abs=1)
    again = type(corridor)(action_repeat=2)
    again.set_state(corridor.get_state())
    assert again.step(np.ones(1, np.float32))[0].tolist() == corridor.step(np.ones(1, np.float32))[0].tolist()


def test_what_is_not_installed_is_told_with_what_is() -> None:
    with pytest.raises(
        ValueError, match=r"pebble\.schemes 'wise': no installed package offers it; there is: none"
    ):
        installed("pebble.schemes", "wise")
