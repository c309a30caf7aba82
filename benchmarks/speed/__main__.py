"""`python -m benchmarks.speed [--peers PYTHON] [--only WORDS]`: a table, and `benchmarks/results/speed.json`."""

from __future__ import annotations

import argparse
import json
import statistics
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.speed.contest import Speeds, contest, ours
from benchmarks.speed.growth import growth, plot
from benchmarks.speed.machine import differences, machine
from benchmarks.speed.rows import Row, all_rows
from benchmarks.speed.sharing import shared_cores
from benchmarks.speed.start import train_to_first_step, up_to_served_page
from benchmarks.speed.table import HEAD, line, table

RESULTS = Path(__file__).parent.parent / "results"
FILE = RESULTS / "speed.json"
PEAK_SIZES = (512, 1024, 2048)
"""Of square products, the fastest of which is the machine's limit."""


def measured(row: Row) -> dict[str, Any]:
    """One row of the table, and every contestant's numbers."""
    contestants = dict(row.contestants)
    if row.flops:
        contestants |= {
            _peak(size): ours("peak", row.threads, precision=row.precision, size=size) for size in PEAK_SIZES
        }
    speeds = contest(contestants, rounds=row.rounds)
    others = [name for name in row.contestants if not name.startswith("ours")]
    best = max(others, key=speeds.median)
    return {
        "name": row.name,
        "unit": row.unit.strip(),
        "ours": shown(row, speeds.median("ours")),
        "best_peer": shown(row, speeds.median(best)),
        "ratio": round(speeds.ratio("ours", best), 2),
        "limit_fraction": _limit_fraction(row, speeds),
        "limit": _limit(row, speeds),
        "peer": best,
        "reach": row.reach,
        "all": {name: _summary(row, speeds, name) for name in row.contestants},
    }


def shown(row: Row, per_second: float) -> float:
    """In the row's unit: a rate, or the time that one takes."""
    value = per_second * row.units if row.unit.endswith("/s") else 1 / (per_second * row.units)
    return float(f"{value:.4g}")


def _summary(row: Row, speeds: Speeds, name: str) -> dict[str, Any]:
    low, high = speeds.spread(name)
    spread = sorted((shown(row, low), shown(row, high)))
    return {
        "median": shown(row, speeds.median(name)),
        "spread": spread,
        "ours_is": speeds.ratio("ours", name),
    }


def _limit_fraction(row: Row, speeds: Speeds) -> float | None:
    if not row.flops:
        return None
    return round(speeds.median("ours") * row.flops / _limit_flops(speeds), 3)


def _limit(row: Row, speeds: Speeds) -> float | None:
    """What the row's matrix products alone would come to at the machine's measured peak."""
    return shown(row, _limit_flops(speeds) / row.flops) if row.flops else None


def _limit_flops(speeds: Speeds) -> float:
    """Floating-point operations a second of the fastest square product."""
    return max(speeds.median(_peak(size)) * 2 * size**3 for size in PEAK_SIZES)


def _peak(size: int) -> str:
    return f"peak {size}"


def started(name: str, start: Callable[[], float], reach: str) -> dict[str, Any]:
    """A row about how long people wait."""
    seconds = [round(start(), 2) for _ in range(3)]
    median = statistics.median(seconds)
    nobody = dict.fromkeys(("best_peer", "ratio", "limit_fraction", "peer"))
    measured = {"ours": {"median": median, "spread": [min(seconds), max(seconds)]}}
    return {"name": name, "unit": "s", "ours": median, **nobody, "reach": reach, "all": measured}


STARTS = {
    "`pebble up` to served page": (up_to_served_page, "≤ 3 s"),
    "`pebble train` to first step": (train_to_first_step, "≤ 8 s"),
}


def everything(peers: Path | None) -> dict[str, Callable[[], dict[str, Any]]]:
    """Every row by its name, in the table's order; calling it measures."""
    contests = {row.name: partial(measured, row) for row in all_rows(peers)}
    waits = {name: partial(started, name, *start) for name, start in STARTS.items()}
    return {**contests, **shared_cores(), **waits}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--peers", type=Path, help="the Python of an environment with peers.txt installed")
    parser.add_argument("--only", default="", help="measure rows whose name holds this; the others stay")
    chosen = parser.parse_args()
    contests = everything(chosen.peers)
    asked = {name: measure for name, measure in contests.items() if chosen.only in name}
    now, before = machine(chosen.peers), kept() if chosen.only else {"rows": []}
    if chosen.only:
        refuse_a_mixed_table(parser, asked, now, before)
    rows = {row["name"]: row for row in before["rows"]}
    print(HEAD)
    for name, measure in asked.items():
        rows[name] = {**measure(), "commit": now.get("commit")}
        print(line(rows[name]), flush=True)
    whole = before if chosen.only else {"machine": now, "growth": growth()}
    write({**whole, "rows": [rows[name] for name in contests if name in rows]})


def kept() -> dict[str, Any]:
    """What was measured before."""
    found: dict[str, Any] = json.loads(FILE.read_text(encoding="utf-8"))
    return found


def refuse_a_mixed_table(
    parser: argparse.ArgumentParser,
    asked: Mapping[str, Any],
    now: Mapping[str, Any],
    before: Mapping[str, Any],
) -> None:
    """Ends with a message where `--only` would measure nothing, or what the rows beside it were not measured on."""
    if not asked:
        parser.error("--only: no row's name holds this; `results/speed.md` lists them")
    if differs := differences(now, before["machine"]):
        parser.error(f"--only: {', '.join(differs)} differ from the other rows' (is --peers missing?)")


def write(measured: dict[str, Any]) -> None:
    """What was measured, its table and its figure."""
    FILE.write_text(json.dumps(measured, indent=1) + "\n", encoding="utf-8")
    FILE.with_suffix(".md").write_text(table(measured["rows"]), encoding="utf-8")
    plot(measured["growth"], RESULTS / "growth.png")


if __name__ == "__main__":
    main()
