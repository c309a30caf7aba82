"""How counts are written for people: the record's sentences and the pages agree."""

from __future__ import annotations

THIN = "\N{NARROW NO-BREAK SPACE}"


def number(value: int) -> str:
    """A count, its thousands apart: 12 400."""
    return f"{value:,}".replace(",", THIN).replace("-", "−")
