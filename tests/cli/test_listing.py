"""What the listing commands print for people."""

from __future__ import annotations

import json
from datetime import timedelta
from pathlib import Path
from types import SimpleNamespace

import pytest

from cli.experiment import list_methods
from cli.listing import list_presets, list_runs
from labels_db.data_folder import DataFolder
from labels_db.methods import methods
from labels_db.presets import presets
from labels_db.records import record_evaluation
from tests.labels_db.given import a_claim, a_run, an_answer, labeller, leases, queries


@pytest.fixture(autouse=True)
def narrow_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")


def first_words(capsys: pytest.CaptureFixture[str]) -> set[str]:
    """Each line's first word, which is a name where the line does not go on with the one above."""
    return {line.split()[0] for line in capsys.readouterr().out.splitlines() if line.strip()}


def test_names_of_presets_and_methods_are_whole(capsys: pytest.CaptureFixture[str]) -> None:
    list_presets(as_json=False)
    assert set(presets()) <= first_words(capsys)
    list_methods(as_json=False)
    assert set(methods()) <= first_words(capsys)


def test_square_brackets_in_a_goal_are_shown(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    odd = SimpleNamespace(
        name="spin", title="Spin", environment="gym:Spin", profiles={}, goal="Turn [clockwise] :wave:"
    )
    monkeypatch.setattr("cli.listing.presets", lambda: {"spin": odd})
    list_presets(as_json=False)
    shown = capsys.readouterr().out
    assert "[clockwise]" in shown
    assert ":wave:" in shown


def test_names_of_runs_are_whole(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data, name = DataFolder(tmp_path), "claims-laptop-walker-walk-no-pretraining-1"
    with data.open_database() as database, database.write() as session:
        a_run(session, name)
    list_runs(data, as_json=False)
    assert name in first_words(capsys)


def test_runs_are_listed_with_what_they_came_to(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = DataFolder(tmp_path)
    with data.open_database() as database, database.write() as session:
        owner = a_claim(session, "mill", budget=20)
        queries(session, owner, 2)
        for number, lease in enumerate(leases(session, labeller(session), 2)):
            an_answer(session, lease, f"a-{number}")
        for step, reached in ((100, 3.0), (200, 5.0)):
            record_evaluation(session, owner, step=step, returns=[reached], measures={}, video_key=None)
        later = a_run(session, "wave")
        later.created_at += timedelta(seconds=1)
    list_runs(data, as_json=True)
    wave, mill = json.loads(capsys.readouterr().out)
    assert (wave["run"], wave["state"], wave["answers"], wave["return"]) == ("wave", "queued", 0, None)
    assert (mill["run"], mill["answers"], mill["budget"], mill["return"]) == ("mill", 2, 20, 5.0)
