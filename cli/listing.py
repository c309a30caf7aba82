"""`pebble runs`, `pebble presets`."""

from __future__ import annotations

import json
from typing import Any

import typer

from cli.tables import plain_console, table_of_names
from labels_db.data_folder import DataFolder
from labels_db.overview import RunOverview, overviews
from labels_db.presets import presets


def list_presets(*, as_json: bool) -> None:
    """Every preset with its profiles, goal and size."""
    rows = [
        {
            "name": preset.name,
            "title": preset.title,
            "environment": preset.environment,
            "goal": preset.goal,
            "profiles": {
                profile: {"steps": config.total_steps, "answers": config.budget}
                for profile, config in preset.profiles.items()
            },
        }
        for preset in presets().values()
    ]
    if as_json:
        typer.echo(json.dumps(rows))
        return
    table = table_of_names("Preset", "Profiles (steps, answers)", "What it teaches")
    for preset in presets().values():
        profiles = ", ".join(f"{n} ({c.total_steps:,}, {c.budget})" for n, c in preset.profiles.items())
        table.add_row(preset.name, profiles, preset.goal)
    plain_console().print(table)


def list_runs(data: DataFolder, *, as_json: bool) -> None:
    """Every run, newest first."""
    with data.open_database() as database, database.read() as session:
        rows = [_row(seen) for seen in overviews(session)]
    if as_json:
        typer.echo(json.dumps(rows))
        return
    table = table_of_names("Run", "State", "Step", "Answers", "Last return")
    for row in rows:
        table.add_row(
            row["run"],
            row["state"],
            f"{row['step']:,} of {row['steps']:,}",
            f"{row['answers']} of {row['budget']}",
            "–" if row["return"] is None else f"{row['return']:.1f}",
        )
    plain_console().print(
        table if rows else "No runs yet. Start one with `pebble train` or from the dashboard."
    )


def _row(seen: RunOverview) -> dict[str, Any]:
    return {
        "run": seen.run.id,
        "state": seen.run.state.value,
        "step": seen.run.step,
        "steps": seen.config.total_steps,
        "answers": seen.feedback.given,
        "budget": seen.feedback.budget,
        "return": seen.last_return,
    }
