"""Errors that a user can mend, said in one line."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager


class UsageError(Exception):
    """What was asked cannot be done; the message names the thing, the value and the way out."""


MENDABLE = {
    "UsageError",
    "RecordError",
    "SettingError",
    "ArtifactError",
    "CheckpointError",
    "EnvironmentUnavailableError",
    "EvaluationError",
    "ExperimentError",
    "ExportError",
    "PortTakenError",
    "RenderingError",
}
"""By name, so that nothing is imported just to be able to name its errors."""


@contextmanager
def explain() -> Iterator[None]:
    try:
        yield
    except KeyboardInterrupt:
        sys.exit(130)
    except Exception as error:
        if MENDABLE.isdisjoint(kind.__name__ for kind in type(error).__mro__):
            raise
        print(f"pebble: {error}", file=sys.stderr)
        sys.exit(2)
