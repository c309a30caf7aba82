"""What the listing commands print for people."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from cli.experiment import list_methods
from cli.listing import list_presets, list_runs
from labels_db.data_folder import DataFolder
from labels_db.methods import methods
from labels_db.presets import presets
from tests.labels_db.given import a_run


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
    database = data.open_database()
    with database.write() as session:
        a_run(session, name)
    database.close()
    list_runs(data, as_json=False)
    assert name in first_words(capsys)
