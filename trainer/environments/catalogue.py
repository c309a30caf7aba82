"""`python -m trainer.environments.catalogue` writes `labels_db/catalogue.json` from the simulators."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import labels_db
from labels_db.catalogue import CatalogueEntry, as_text
from labels_db.run_config import Behaviour, DMControl, EnvironmentConfig, Gymnasium, MetaWorld
from trainer.environments import make_environment
from trainer.environments.behaviours import BEHAVIOURS
from trainer.environments.goals import ENDING_EARLY, GOALS, TITLES
from trainer.environments.gym_goals import GYM_GOALS
from trainer.environments.meta_world_goals import META_WORLD_GOALS, META_WORLD_TITLES

PATH = Path(labels_db.__file__).with_name("catalogue.json")


def measure(config: EnvironmentConfig, title: str, goal: str, *, random_steps: int = 0) -> CatalogueEntry:
    """The entry of one environment, its sizes and times asked of the simulator.

    `random_steps` says how long random episodes last where they can end early.
    """
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
        ends_early=random_steps > 0,
        random_steps=random_steps,
    )


def entries() -> Iterator[CatalogueEntry]:
    """Every behaviour, and every task of the suite, of Meta-world and of Gymnasium's MuJoCo."""
    # Not validated: a new environment is in no catalogue yet, and this is how it comes into one.
    for name, behaviour in BEHAVIOURS.items():
        yield measure(Behaviour.model_construct(behaviour=name), behaviour.title, behaviour.goal)
    for task, title in TITLES.items():
        suite = DMControl.model_construct(task=task)
        yield measure(suite, title, GOALS[task], random_steps=ENDING_EARLY.get(task, 0))
    for task, title in META_WORLD_TITLES.items():
        yield measure(MetaWorld.model_construct(task=task), title, META_WORLD_GOALS[task])
    for id, known in GYM_GOALS.items():
        registered = Gymnasium.model_construct(id=id)
        yield measure(registered, known.title, known.goal, random_steps=known.random_steps)


def catalogue_text() -> str:
    """The catalogue as JSON."""
    return as_text(entries())


def main() -> None:
    """Write the catalogue."""
    PATH.write_text(catalogue_text(), encoding="utf-8")


if __name__ == "__main__":
    main()
