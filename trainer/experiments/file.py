"""An experiment's file: YAML that a person can read."""

from __future__ import annotations

from pathlib import Path

import yaml
from pydantic import ValidationError

from labels_db.experiments import Experiment, PlannedRun


class ExperimentError(Exception):
    """The experiment cannot be lived through as asked; the message says where and what."""


def read_experiment(path: Path) -> Experiment:
    """The experiment of that file, every run's configuration checked; ExperimentError names what is wrong."""
    try:
        experiment = Experiment.model_validate(yaml.safe_load(path.read_text(encoding="utf-8")))
        for planned in experiment.planned():
            _check(planned)
    except OSError as error:
        raise ExperimentError(f"{path}: cannot be read ({error.strerror})") from error
    except yaml.YAMLError as error:
        raise ExperimentError(f"{path}: is not YAML: {error}") from error
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise ExperimentError(f"{path}: {place}: {first['msg']}") from error
    except ValueError as error:
        raise ExperimentError(f"{path}: {error}") from error
    return experiment


def _check(planned: PlannedRun) -> None:
    try:
        planned.config  # noqa: B018  (it is checked when it is made)
    except ValueError as error:
        raise ValueError(f"{planned.run_id}: {error}") from error
