"""A command in words: how it stands and what came of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from labels_db.models import Command
from labels_db.numbers import number
from server.words import decimal, measure, plural, size


def error_of(command: Command) -> str | None:
    """Why nothing came of it."""
    return None if command.result is None else command.result.get("error")


def download_url(command: Command) -> str | None:
    """Where to fetch the policy that it exported."""
    if "artifact" not in (command.result or {}):
        return None
    return f"/runs/{command.run_id}/exports/{command.id}"


def command_sentence(command: Command) -> str:
    """How it stands, or what came of it."""
    if command.taken_at is None:
        return "Waiting for the supervisor."
    if command.result is None:
        return WORDS[command.kind][0]
    if error := error_of(command):
        return f"That did not work: {error}"
    return WORDS[command.kind][1](command.result)


def evaluated(result: dict[str, Any]) -> str:
    measures = "".join(
        f", {name.replace('_', ' ')} {measure(value)}" for name, value in result["measures"].items()
    )
    mean, episodes = decimal(result["return"]), plural(result["episodes"], "episode")
    return f"After step {number(result['step'])}: true return {mean} over {episodes}{measures}."


def exported(result: dict[str, Any]) -> str:
    return f"The policy after step {number(result['step'])}, {size(result['bytes'])}."


def drawn(result: dict[str, Any]) -> str:
    return f"A video of the policy after step {number(result['step'])}."


WORDS: Mapping[str, tuple[str, Callable[[dict[str, Any]], str]]] = MappingProxyType(
    {
        "evaluate": ("Evaluating.", evaluated),
        "video": ("Drawing.", drawn),
        "export-policy": ("Exporting.", exported),
    }
)
"""What each command says while it is done, and of its result."""
