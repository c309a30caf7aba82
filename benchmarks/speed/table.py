"""Measured rows as a table in Markdown."""

from __future__ import annotations

from typing import Any

HEAD = """\
| what | ours | spread | others | ours is × faster | of the matrix limit | reach |
|---|---|---|---|---|---|---|"""


def table(rows: list[dict[str, Any]]) -> str:
    """All rows in Markdown."""
    return "\n".join([HEAD, *map(line, rows), ""])


def line(row: dict[str, Any]) -> str:
    """The row in Markdown."""
    cells = [row["name"], f"{row['ours']:.4g} {row['unit']}".replace(" /", "/"), _spread(row)]
    cells += [" · ".join(column) or "–" for column in _others(row)]
    cells.append("–" if row["limit_fraction"] is None else f"{100 * row['limit_fraction']:.0f} %")
    return "| " + " | ".join([*cells, row["reach"]]) + " |"


def _others(row: dict[str, Any]) -> tuple[list[str], list[str]]:
    """Who else took part, and how many times as fast ours is as each, in the same order."""
    if row["peer"] is None:
        return [], []
    others = {
        name: rest for name, rest in row["all"].items() if "ours_is" in rest and not name.startswith("ours")
    }
    if not others:
        return [f"{row['best_peer']:.4g} ({row['peer']})"], [f"{row['ratio']:.2f}"]
    return (
        [f"{rest['median']:.4g} ({name})" for name, rest in others.items()],
        [f"{rest['ours_is']:.2f}" for rest in others.values()],
    )


def _spread(row: dict[str, Any]) -> str:
    """Between which of its rounds ours lay."""
    low, high = row["all"].get("ours", {}).get("spread", (None, None))
    return "–" if low is None else f"{low:.4g} … {high:.4g}"
