"""What is known of every environment without a simulator.

`catalogue.json` beside this file is written by the trainer; an installation adds environments of its own by
`pebble environments --add`, which writes the `catalogue.json` of its data folder.
"""

from __future__ import annotations

import dataclasses
import difflib
import functools
import json
from collections.abc import Iterable
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

ENDS_EARLY = (
    "Episodes of {name} can end early. What ends them gives the task away: a short episode shows failure or success"
    " whatever the labels say. Segments are cut only from episodes long enough for them: where nothing is asked,"
    " make feedback.segment_steps smaller."
)
UNDRAWN = (
    "Moments of {name} cannot be drawn again: there are no clips and no videos,"
    " and only scripted teachers can be asked."
)


class EnvironmentUnavailableError(ValueError):
    """A configuration's environment is not to be had here; the message says how it would be."""


@dataclass(frozen=True)
class CatalogueEntry:
    """An environment: sizes of its flat observation and action, time in seconds, what it asks for.

    `state_size` is 0 where a moment cannot be drawn again; `ends_early` says that an episode can end before its
    time by what the robot does, `random_steps` after how many control steps half of those with random actions have
    ended then; 0 where that is not known.
    """

    name: str
    title: str
    observation_size: int
    action_size: int
    state_size: int
    control_step: float
    episode_steps: int
    goal: str
    ends_early: bool = False
    random_steps: int = 0

    @property
    def can_be_drawn(self) -> bool:
        return self.state_size > 0

    @property
    def caveats(self) -> list[str]:
        """What somebody should know who has it learned from preferences."""
        known = [(self.ends_early, ENDS_EARLY), (not self.can_be_drawn, UNDRAWN)]
        return [text.format(name=self.name) for holds, text in known if holds]


_included: set[Path] = set()


def include(path: Path) -> None:
    """From now on this process knows what that file lists too, whenever it is written."""
    _included.add(path.resolve())


def included() -> list[Path]:
    """The files that were included, for other processes to know the same."""
    return sorted(_included)


@functools.cache
def _packaged() -> dict[str, CatalogueEntry]:
    text = resources.files("labels_db").joinpath("catalogue.json").read_text(encoding="utf-8")
    return _entries(text)


def _entries(text: str) -> dict[str, CatalogueEntry]:
    return {row["name"]: CatalogueEntry(**row) for row in json.loads(text)}


def read(path: Path) -> dict[str, CatalogueEntry]:
    """What a file lists; nothing where there is none."""
    return _entries(path.read_text(encoding="utf-8")) if path.exists() else {}


def catalogue() -> dict[str, CatalogueEntry]:
    """Every environment by name, as in `dmc:walker-walk`."""
    known = dict(_packaged())
    for path in included():
        known = {**read(path), **known}
    return known


def entry(name: str) -> CatalogueEntry:
    """The entry of that name; ValueError names the closest ones."""
    known = _packaged() if name in _packaged() else catalogue()
    if name not in known:
        close = difflib.get_close_matches(name, known, n=3) or sorted(known)[:3]
        raise ValueError(f"environment {name!r}: unknown; did you mean {', '.join(close)}?")
    return known[name]


def as_text(entries: Iterable[CatalogueEntry]) -> str:
    """A catalogue as JSON, one environment a row, sorted by name."""
    rows = sorted(map(dataclasses.asdict, entries), key=lambda row: row["name"])
    return "[\n" + ",\n".join(json.dumps(row, ensure_ascii=False) for row in rows) + "\n]\n"
