"""`python -m trainer.environments.catalogue` writes `labels_db/catalogue.json` from the simulators."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from pathlib import Path

import labels_db
from labels_db.catalogue import CatalogueEntry
from labels_db.run_config import Behaviour, DMControl
from trainer.environments import make_environment
from trainer.environments.behaviours import BEHAVIOURS
from trainer.environments.goals import GOALS, TITLES

PATH = Path(labels_db.__file__).with_name("catalogue.json")


def measure(config: DMControl | Behaviour, title: str, goal: str) -> CatalogueEntry:
    """The entry of one environment, its sizes and times asked of the simulator."""
    environment = make_environment(config)
    observation, action = environment.observation_space.shape, environment.action_space.shape
    assert observation is not None
    assert action is not None
    return CatalogueEntry(
        name=config.name,
        title=title,
        observation_size=observation[0],
        action_size=action[0],
        state_size=environment.state_size,
        control_step=round(environment.control_step, 9),
        episode_steps=environment.episode_steps,
        goal=goal,
    )


def entries() -> Iterator[CatalogueEntry]:
    """Every behaviour and every task of the suite."""
    # Not validated: a new environment is in no catalogue yet, and this is how it comes into one.
    for name, behaviour in BEHAVIOURS.items():
        yield measure(Behaviour.model_construct(behaviour=name), behaviour.title, behaviour.goal)
    for task, title in TITLES.items():
        yield measure(DMControl.model_construct(task=task), title, GOALS[task])


def catalogue_text() -> str:
    """The catalogue as JSON, one environment a row, sorted by name."""
    rows = sorted(map(dataclasses.asdict, entries()), key=lambda row: row["name"])
    return "[\n" + ",\n".join(json.dumps(row, ensure_ascii=False) for row in rows) + "\n]\n"


def main() -> None:
    """Write the catalogue."""
    PATH.write_text(catalogue_text(), encoding="utf-8")


if __name__ == "__main__":
    main()
