"""What `--set` takes."""

from __future__ import annotations

from collections.abc import Iterable

from cli.errors import UsageError


def by_name(settings: Iterable[str], form: str) -> dict[str, str]:
    """Values by their names; UsageError says which form one lacks."""
    named = {}
    for setting in settings:
        name, equals, value = setting.partition("=")
        if not equals:
            raise UsageError(f"--set {setting}: must be {form}")
        named[name] = value
    return named
