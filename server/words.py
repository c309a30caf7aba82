"""Numbers, sizes and times as people say them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from datetime import datetime
from typing import Any

from labels_db.config_differences import Absent
from labels_db.evaluation_curves import RETURN, Spread
from labels_db.models import utc_now
from labels_db.numbers import THIN, number


def decimal(value: float | None, places: int = 1) -> str:
    """A measured number, or a dash where there is none yet."""
    if value is None:
        return "–"
    return f"{value:,.{places}f}".replace(",", THIN).replace("-", "−")


def size(count: int) -> str:
    """Bytes in the unit that reads best."""
    value, units = float(count), ["bytes", "kB", "MB", "GB", "TB"]
    while value >= 1000 and len(units) > 1:
        value, units = value / 1000, units[1:]
    places = 1 if value < 10 and units[0] != "bytes" else 0
    return f"{value:.{places}f} {units[0]}"


def duration(seconds: float) -> str:
    """A stretch of time in its largest sensible unit: 20 s, 3 min, 2 h, 5 days."""
    for limit, unit, name in ((90, 1, "s"), (5400, 60, "min"), (48 * 3600, 3600, "h")):
        if seconds < limit:
            return f"{max(0, round(seconds / unit))} {name}"
    return f"{round(seconds / 86400)} days"


def ago(moment: datetime | None, now: datetime | None = None) -> str:
    """How long ago, or "never"."""
    if moment is None:
        return "never"
    seconds = ((now or utc_now()) - moment).total_seconds()
    return "just now" if seconds < 2 else f"{duration(seconds)} ago"


def exact(moment: datetime) -> str:
    """The moment to the second, for hovering."""
    return moment.strftime("%Y-%m-%d %H:%M:%S UTC")


def plural(count: int, noun: str) -> str:
    """A count of things: 1 answer, 6 answers, 3 queries."""
    several = f"{noun[:-1]}ies" if noun.endswith("y") else f"{noun}s"
    return f"{number(count)} {noun if count == 1 else several}"


def percent(share: float | None) -> str:
    """A share in percent, or a dash where there is none."""
    return "–" if share is None else f"{share:.0%}"


def measure(value: object) -> str:
    """What an evaluation measured: a count whole, another number with a decimal, anything else as it is."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return decimal(value, 0 if math.isfinite(value) and value == int(value) else 1)
    return str(value)


def figure(value: float | None) -> str:
    """A measured number with as many decimals as its size bears: 812.3, 0.85."""
    return decimal(value, _places(value or 0))


def _places(value: float) -> int:
    return 1 if abs(value) >= 10 else 2


def spread(found: Spread | None) -> str:
    """Mean ± standard deviation; of a single run its value alone."""
    if found is None or found.count == 1:
        return figure(found.mean if found else None)
    return f"{figure(found.mean)} ± {decimal(found.deviation, _places(found.mean))}"


def measure_name(name: str) -> str:
    """What an evaluation measures, as a heading: True return, Largest tilt."""
    return "True return" if name == RETURN else name.replace("_", " ").capitalize()


_SETTINGS: Mapping[type, Callable[[Any], str]] = {
    Absent: lambda _value: "–",
    type(None): lambda _value: "not set",
    bool: lambda value: "yes" if value else "no",
    int: number,
    float: "{:g}".format,
}


def setting(value: object) -> str:
    """A configuration's value; a dash where the configuration has no such setting."""
    return _SETTINGS.get(type(value), str)(value)
