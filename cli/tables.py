"""How lists are shown in a terminal."""

from __future__ import annotations

from rich.table import Table


def table_of_names(heading: str, *others: str) -> Table:
    """A table whose first column holds names that people type again: the other columns give way to it."""
    table = Table(box=None, pad_edge=False)
    table.add_column(heading, no_wrap=True)
    for other in others:
        table.add_column(other, overflow="fold")
    return table
