"""Trying an environment before it is added to a catalogue: does it hold what every environment promises?"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np

from labels_db.catalogue import CatalogueEntry, as_text, read
from labels_db.run_config import Behaviour, EnvironmentConfig, Gymnasium, InstalledEnvironment
from trainer.environments import Action, Environment, behaviour_named, make_environment
from trainer.environments.catalogue import measure

EPISODES = 5
STEPS = 30
SEED = 7


# Not validated: a new environment is in no catalogue yet, and this is how it comes into one.
ADDED: Mapping[str, Callable[[str], EnvironmentConfig]] = MappingProxyType(
    {
        "gym": lambda id: Gymnasium.model_construct(id=id),
        "installed": lambda name: InstalledEnvironment.model_construct(environment=name),
        "behaviour": lambda name: Behaviour.model_construct(behaviour=name),
    }
)
"""Families of which an installation may have members of its own."""


def add(path: Path, name: str, title: str | None = None, goal: str | None = None) -> CatalogueEntry:
    """Try the environment of that name and add it to the catalogue in the file, or replace it there.

    Without words for people, a behaviour brings its own; others are called as they are named.
    """
    family, _, called = name.partition(":")
    if family not in ADDED:
        raise ValueError(
            f"environment {name!r}: cannot be added; one is named as in gym:Hopper-v5, installed:NAME"
        )
    config = ADDED[family](called)
    first, second = make_environment(config), make_environment(config)
    check_goes_on(name, first, second)
    own_title, own_goal = words(family, called)
    added = measure(config, title or own_title, goal or own_goal, random_steps=random_steps(first))
    text = as_text({**read(path), name: added}.values())
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_suffix(".unfinished")
    unfinished.write_text(text, encoding="utf-8")
    unfinished.replace(path)
    return added


def words(family: str, called: str) -> tuple[str, str]:
    """Title and goal of an environment that nobody has described."""
    if family == "behaviour":
        behaviour = behaviour_named(called)
        return behaviour.title, behaviour.goal
    return called, "Prefer the clip in which the robot comes closer to what it is for."


def check_goes_on(name: str, first: Environment, second: Environment) -> None:
    """From one's state in the middle of an episode, the other must live exactly the same; ValueError if not."""
    first.reset(seed=SEED)
    steps = actions(first)
    for _, action in zip(range(STEPS), steps, strict=False):
        _, _, terminated, truncated, _ = first.step(action)
        if terminated or truncated:
            first.reset(seed=SEED + 1)
    second.set_state(first.get_state())
    for _, action in zip(range(STEPS), steps, strict=False):
        mine, theirs = first.step(action), second.step(action)
        if np.asarray(getattr(first, "moments", ())).shape[1:] != (first.state_size,):
            raise ValueError(
                f"environment {name!r}: has no `moments` [action_repeat, S] of its last step to draw"
            )
        if not np.array_equal(mine[0], theirs[0]) or mine[1:4] != theirs[1:4]:
            raise ValueError(
                f"environment {name!r}: the same seed and actions led elsewhere, so that no run could be resumed"
            )
        if mine[2] or mine[3]:
            break


def random_steps(environment: Environment) -> int:
    """What half of some episodes with random actions last; 0 where none ends before its time."""
    steps, lasted, early = actions(environment), [], False
    for episode in range(EPISODES):
        environment.reset(seed=episode)
        for count, action in enumerate(steps, start=1):
            _, _, terminated, truncated, _ = environment.step(action)
            if terminated or truncated:
                lasted.append(count)
                early = early or terminated
                break
    return statistics.median_low(lasted) if early else 0


def actions(environment: Environment) -> Iterator[Action]:
    """Uniformly random actions, the same ones every time."""
    draw, shape = np.random.default_rng(SEED), environment.action_space.shape
    while True:
        yield draw.uniform(-1, 1, shape).astype(np.float32)
