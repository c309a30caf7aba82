"""`python -m benchmarks.speed [--peers PYTHON] [--only WORDS]`: a table, and `benchmarks/results/speed.json`."""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.speed.contest import Speeds, contest, ours
from benchmarks.speed.growth import growth, plot
from benchmarks.speed.rows import Row, all_rows
from benchmarks.speed.sharing import shared_cores
from benchmarks.speed.start import processor, train_to_first_step, up_to_served_page
from trainer.experiments.provenance import versions

RESULTS = Path(__file__).parent.parent / "results"
PEAK_FLOPS = 2 * 2048**3
HEAD = """\
| what | ours | spread | others | ours is × faster | of the matrix limit | reach |
|---|---|---|---|---|---|---|"""


def measured(row: Row) -> dict[str, Any]:
    """One row of the table, and every contestant's numbers."""
    contestants = dict(row.contestants)
    if row.flops:
        contestants["peak"] = ours("peak", row.threads, precision=row.precision)
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
    return round(speeds.ratio("ours", "peak") * row.flops / PEAK_FLOPS, 3)


def _limit(row: Row, speeds: Speeds) -> float | None:
    """What the row's matrix products alone would come to at the machine's measured peak."""
    return shown(row, speeds.median("peak") * PEAK_FLOPS / row.flops) if row.flops else None


def starts() -> Iterator[dict[str, Any]]:
    for name, start, reach in (
        ("`pebble up` to served page", up_to_served_page, "≤ 3 s"),
        ("`pebble train` to first step", train_to_first_step, "≤ 8 s"),
    ):
        seconds = [round(start(), 2) for _ in range(3)]
        median = statistics.median(seconds)
        nobody = dict.fromkeys(("best_peer", "ratio", "limit_fraction", "peer"))
        measured = {"ours": {"median": median, "spread": [min(seconds), max(seconds)]}}
        yield {"name": name, "unit": "s", "ours": median, **nobody, "reach": reach, "all": measured}


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


def machine(peers: Path | None) -> dict[str, Any]:
    found = versions()
    if peers is not None:
        listed = subprocess.run(
            [peers, "-m", "pip", "list", "--format=json"], capture_output=True, check=True
        )
        wanted = {"stable_baselines3", "sbx-rl", "jax", "jaxlib", "torch"}
        found |= {
            f"peers' {p['name']}": p["version"] for p in json.loads(listed.stdout) if p["name"] in wanted
        }
    return {"processor": processor(), **found}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--peers", type=Path, help="the Python of an environment with peers.txt installed")
    parser.add_argument("--only", default="", help="rows whose name holds this; nothing is written then")
    chosen = parser.parse_args()
    print(HEAD)
    rows = []
    for row in all_rows(chosen.peers):
        if chosen.only in row.name:
            rows.append(measured(row))
            print(line(rows[-1]), flush=True)
    if chosen.only:
        return
    for other_row in (*shared_cores(), *starts()):
        rows.append(other_row)
        print(line(other_row), flush=True)
    (RESULTS / "speed.md").write_text(table(rows), encoding="utf-8")
    curves = growth()
    plot(curves, RESULTS / "growth.png")
    written = {"machine": machine(chosen.peers), "rows": rows, "growth": curves}
    (RESULTS / "speed.json").write_text(json.dumps(written, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
