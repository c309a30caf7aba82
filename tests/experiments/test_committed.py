"""What is committed beside the code: ready experiments, results and their tables, the documented example."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from cli.experiment import plot
from labels_db.data_folder import DataFolder
from labels_db.figures import Ends
from labels_db.run_config import Sessions
from trainer.experiments.drawing import Drawing
from trainer.experiments.file import read_experiment
from trainer.experiments.results import Results

EXPERIMENTS = Path(__file__).parents[2] / "benchmarks" / "experiments"
RESULTS = EXPERIMENTS.parent / "results"
DOCS = Path(__file__).parents[2] / "docs"
COMMITTED = [
    path for path in RESULTS.glob("*/results.parquet") if (EXPERIMENTS / f"{path.parent.name}.yaml").exists()
]


@pytest.fixture(scope="module", params=COMMITTED, ids=lambda path: path.parent.name)
def kept_and_drawn(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, Path]:
    """Committed results, and the figures that today's code draws of them, without the runs that they came from."""
    kept, out = request.param.parent, tmp_path_factory.mktemp("figures")
    plot(EXPERIMENTS / f"{kept.name}.yaml", DataFolder(out / "data"), out, kept)
    return kept, out


def test_committed_tables_are_those_of_the_committed_results(kept_and_drawn: tuple[Path, Path]) -> None:
    kept, drawn = kept_and_drawn
    tables = sorted(path.name for path in drawn.glob("*.md"))
    assert tables
    for name in tables:
        assert (drawn / name).read_text(encoding="utf-8") == (kept / name).read_text(encoding="utf-8")


def test_every_figure_of_committed_results_is_committed(kept_and_drawn: tuple[Path, Path]) -> None:
    """Those of the runs too, which only whoever has these can draw."""
    kept, drawn = kept_and_drawn
    figures = read_experiment(EXPERIMENTS / f"{kept.name}.yaml").figures
    wanted = {figure.path for figure in figures if figure.of_runs or (drawn / figure.path).exists()}
    assert wanted <= {path.name for path in kept.iterdir()}


def test_no_two_methods_look_alike(tmp_path: Path) -> None:
    for file in EXPERIMENTS.glob("*.yaml"):
        experiment = read_experiment(file)
        drawing = Drawing(experiment, Results([]), DataFolder(tmp_path), tmp_path)
        styles = [tuple(drawing.style(one.name).values()) for one in experiment.compared]
        assert len(set(styles)) == len(styles), file.name


@pytest.mark.parametrize("file", sorted(EXPERIMENTS.glob("*.yaml")), ids=lambda file: file.stem)
def test_ready_files_say_valid_experiments(file: Path) -> None:
    experiment = read_experiment(file)
    assert experiment.name == file.stem
    assert experiment.figures


@pytest.mark.parametrize("file", sorted(EXPERIMENTS.glob("*.yaml")), ids=lambda file: file.stem)
def test_no_ready_file_lives_one_configuration_twice(file: Path) -> None:
    configs = [one.config.model_dump_json() for one in read_experiment(file).planned()]
    assert len(set(configs)) == len(configs)


def test_the_claims_compare_at_equal_answers_and_ten_times_the_steps() -> None:
    configs = {
        (one.task, one.compared.name): one.config
        for one in read_experiment(EXPERIMENTS / "claims-laptop.yaml").planned()
    }
    for task in ("cartpole-swingup", "walker-walk"):
        pebble, rival, bound = (configs[task, name] for name in ("pebble", "preference-ppo", "ppo"))
        assert pebble.budget == configs[task, "no-relabel"].budget == rival.budget
        assert configs[task, "pebble-100"].budget == configs[task, "no-pretraining-100"].budget
        assert rival.total_steps == bound.total_steps == 10 * pebble.total_steps
        assert pebble.total_steps == configs[task, "sac"].total_steps


def test_the_claims_ask_all_their_answers_while_there_are_steps_to_learn_from_them() -> None:
    for one in read_experiment(EXPERIMENTS / "claims-laptop.yaml").planned():
        if isinstance(feedback := one.config.feedback, Sessions):
            sessions = math.ceil(feedback.budget / feedback.queries_per_session)
            last = one.config.exploration.ends_at + (sessions - 1) * feedback.steps_between
            assert last <= 0.8 * one.config.total_steps, one.run_id


def test_few_labels_stand_beside_what_others_published() -> None:
    """Of PEBBLE by its own authors' code, as PPE's first table has it: success is a rate."""
    tables = [
        one for one in read_experiment(EXPERIMENTS / "few-labels.yaml").figures if isinstance(one, Ends)
    ]
    assert all(table.methods == ["pebble"] for table in tables)
    assert {table.measure: table.published for table in tables} == {
        "return": {"walker-walk": 453, "cheetah-run": 546, "quadruped-walk": 364},
        "success": {"door-open": 0.72, "window-open": 0.87, "button-press": 0.77},
    }


def test_the_documented_experiment_is_one(tmp_path: Path) -> None:
    (block,) = re.findall(
        r"```yaml\n(.*?)```", (DOCS / "experiments.md").read_text(encoding="utf-8"), re.DOTALL
    )
    (tmp_path / "documented.yaml").write_text(block, encoding="utf-8")
    assert read_experiment(tmp_path / "documented.yaml").figures
