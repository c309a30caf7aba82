"""How words and lists are shown in a terminal."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table


def plain_console(*, stderr: bool = False) -> Console:
    """Prints what it is given: square brackets and colons in somebody's words are no markup."""
    return Console(stderr=stderr, markup=False, emoji=False)


def table_of_names(heading: str, *others: str) -> Table:
    """A table whose first column holds names that people type again: the other columns give way to it."""
    table = Table(box=None, pad_edge=False)
    table.add_column(heading, no_wrap=True)
    for other in others:
        table.add_column(other, overflow="fold")
    return table
