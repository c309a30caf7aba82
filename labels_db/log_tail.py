"""The end of a run's log."""

from __future__ import annotations

from pathlib import Path

TAIL_BYTES = 64 * 1024


def log_tail(path: Path, lines: int) -> list[str]:
    """The log's last lines, read from its last 64 kB; none before the run's first start."""
    try:
        with path.open("rb") as file:
            size = file.seek(0, 2)
            file.seek(max(0, size - TAIL_BYTES))
            text = file.read().decode("utf-8", errors="replace")
    except FileNotFoundError:
        return []
    kept = text.splitlines()
    return kept[-lines:] if size <= TAIL_BYTES else kept[1:][-lines:]  # the first is cut off at its front
