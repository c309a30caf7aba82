"""What differs between configurations, setting by setting."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from labels_db.config_fields import ConfigField, fields_of
from labels_db.run_config import RunConfig


class Absent:
    """Stands for the value of a setting that a configuration has no place for."""


ABSENT = Absent()


@dataclass(frozen=True)
class Difference:
    """One setting and its value in each configuration."""

    path: str
    description: str
    values: Sequence[Any]

    @property
    def everywhere(self) -> bool:
        """Whether every configuration has this setting; else its difference follows from that of a kind."""
        return ABSENT not in self.values


def config_differences(configs: Sequence[RunConfig]) -> list[Difference]:
    """The settings that are not the same everywhere, in the configurations' own order."""
    known = [{setting.path: setting for setting in fields_of(config)} for config in configs]
    paths = sorted(dict.fromkeys(path for each in known for path in each), key=_part)
    found = [_difference(path, known) for path in paths]
    return [each for each in found if any(value != each.values[0] for value in each.values)]


def _part(path: str) -> int:
    """Settings of one part stay together, also those that only some of its kinds have."""
    return list(RunConfig.model_fields).index(path.partition(".")[0])


def _difference(path: str, known: Sequence[dict[str, ConfigField]]) -> Difference:
    settings = [each.get(path) for each in known]
    return Difference(
        path=path,
        description=next(setting.description for setting in settings if setting),
        values=[setting.value if setting else ABSENT for setting in settings],
    )
