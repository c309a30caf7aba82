"""How many cores there are for us, which may be fewer than the machine has."""

from __future__ import annotations

import os
from pathlib import Path

QUOTA = Path("/sys/fs/cgroup/cpu.max")
"""A container's allowance, as in `150000 100000`: so many microseconds of processor time in so many."""


def available_cores(quota: Path = QUOTA) -> int:
    """Cores this process may run on, by its affinity and its container's allowance; at least 1."""
    able = getattr(os, "sched_getaffinity", None)  # Linux alone has it
    cores = len(able(0)) if able else os.cpu_count() or 1
    return max(1, min(cores, int(_allowed(quota))))


def _allowed(quota: Path) -> float:
    try:
        share, _, period = quota.read_text(encoding="utf-8").partition(" ")
        return float(share) / float(period)  # the share is "max" where there is no limit
    except (OSError, ValueError):
        return os.cpu_count() or 1
