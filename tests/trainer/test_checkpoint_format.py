"""A checkpoint of another format or with other parts is refused by name, whoever loads it."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from functools import partial, reduce
from operator import getitem
from pathlib import Path
from typing import Any

import pytest

from labels_db.models import Command, RunState
from labels_db.records import checkpoints_of
from labels_db.runs import get_run, resume_run
from labels_db.storage import sha256
from tests.trainer.conftest import RUN, Lab, new_lab, small_config
from tests.trainer.whole_runs import live_until
from trainer.checkpoint_format import FORMAT, why_another_made_it
from trainer.checkpoints import CheckpointError
from trainer.commands import do
from trainer.policy import load_policy
from trainer.replay import replay
from trainer.state_tree import pack

Change = Callable[[dict[str, Any]], object]


@pytest.fixture(scope="module")
def stopped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The data folder of a run that was stopped after its first answers."""
    lab = new_lab(tmp_path_factory.mktemp("stopped"))
    lab.request(small_config())
    assert live_until(lab, 320) is RunState.STOPPED
    lab.database.close()
    return lab.data.path


@pytest.fixture
def left(stopped: Path, tmp_path: Path) -> Iterator[Lab]:
    """A copy of that run, to be altered."""
    lab = new_lab(shutil.copytree(stopped, tmp_path / "data"))
    yield lab
    lab.database.close()


def alter(lab: Lab, change: Change) -> int:
    """Make the run's last checkpoint, by its manifest, what another Pebble would have written; its step."""
    with lab.database.write() as session:
        last = checkpoints_of(session, RUN)[0]
        manifest = json.loads(lab.store.read(last.manifest_key))
        change(manifest)
        data = json.dumps(manifest).encode()
        lab.store.write(last.manifest_key, data)
        last.checksum = sha256(data)
        return last.step


def error_of_resumed(lab: Lab) -> str:
    with lab.database.write() as session:
        resume_run(session, RUN)
    assert lab.live() is RunState.FAILED
    with lab.database.read() as session:
        return get_run(session, RUN).error or ""


def commanded(lab: Lab, kind: str, **arguments: Any) -> str:
    done = do(Command(id=7, run_id=RUN, kind=kind, arguments=arguments), lab.database, lab.store)
    return str(done["error"])


def refused(load: Callable[[], object]) -> str:
    with pytest.raises(CheckpointError) as caught:
        load()
    return str(caught.value)


LOADERS: dict[str, Callable[[Lab], str]] = {
    "resume": error_of_resumed,
    "evaluate": lambda lab: commanded(lab, "evaluate", episodes=1),
    "export": lambda lab: commanded(lab, "export-policy", format="onnx"),
    "replay": lambda lab: refused(lambda: replay(lab.database, lab.store, RUN, lambda _steps: None)),
    "draw": lambda lab: refused(lambda: load_policy(lab.database, lab.store, RUN)),
}


def place(manifest: dict[str, Any], path: str) -> tuple[dict[str, Any], str]:
    """Where in the state a part lies, and what it is called there."""
    *way, name = path.split("/")
    return reduce(getitem, way, manifest["values"]), name


def drop(path: str, manifest: dict[str, Any]) -> None:
    within, name = place(manifest, path)
    del within[name]


def add(path: str, manifest: dict[str, Any]) -> None:
    within, name = place(manifest, path)
    within[name] = {"good": True}


LACKING = ("told", "agent/log_temperature", "feedback/told_shortage", "reward/optimizer/second")
CHANGES: dict[str, Change] = {
    **{f"lacks the part {path}": partial(drop, path) for path in LACKING},
    **{f"has an unknown part {path}": partial(add, path) for path in ("mood", "agent/mood")},
}


@pytest.mark.parametrize("loader", LOADERS)
@pytest.mark.parametrize(
    "difference", ["lacks the part agent/log_temperature", "has an unknown part agent/mood"]
)
def test_it_is_refused_wherever_it_is_loaded(left: Lab, loader: str, difference: str) -> None:
    step = alter(left, CHANGES[difference])
    assert (
        f"run {RUN}: its checkpoint at step {step} {difference}: made by another Pebble; start a new run"
        " (the record of this one and its answers stay)"
    ) in LOADERS[loader](left)


@pytest.mark.parametrize("difference", CHANGES)
def test_every_part_is_looked_at(left: Lab, difference: str) -> None:
    alter(left, CHANGES[difference])
    assert difference in refused(lambda: load_policy(left.database, left.store, RUN))


@pytest.mark.parametrize(
    ("made", "whose"), [(FORMAT + 1, "a newer Pebble; update"), (FORMAT - 1, "an older Pebble")]
)
def test_another_format_is_named_before_its_parts_are_looked_at(left: Lab, made: int, whose: str) -> None:
    alter(left, lambda manifest: manifest.update(format=made, values={}))
    why = refused(lambda: load_policy(left.database, left.store, RUN))
    assert f"run {RUN}: checkpoint of format {made}, where {FORMAT} is known: made by {whose}" in why


def test_all_that_differs_is_named_and_a_part_that_is_something_else_lacks_its_own() -> None:
    config = small_config(reward__kind="true", feedback__kind="none", exploration__kind="random")
    values, _ = pack({"step": 3, "agent": 5, "reward": {"members": 1}})
    why = why_another_made_it({"format": FORMAT, "step": 3, "values": values}, config)
    assert "lacks the part told, " in why
    assert "lacks the part agent/updates, " in why
    assert "has an unknown part reward/members: made by" in why


def test_it_goes_on_from_its_own(left: Lab) -> None:
    alter(left, lambda _manifest: None)
    with left.database.write() as session:
        resume_run(session, RUN)
    assert left.live() is RunState.FINISHED
