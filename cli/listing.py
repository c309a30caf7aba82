"""`pebble runs`, `pebble presets`."""

from __future__ import annotations

import json

import typer
from sqlalchemy import select

from cli.tables import plain_console, table_of_names
from labels_db.data_folder import DataFolder
from labels_db.feedback_progress import feedback_progress
from labels_db.models import Run
from labels_db.presets import presets
from labels_db.records import evaluations_of


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
        found = session.scalars(select(Run).order_by(Run.created_at.desc())).all()
        rows = []
        for run in found:
            counted, lived = feedback_progress(session, run), evaluations_of(session, run.id)
            last = lived[-1].mean_return if lived else None
            rows.append(
                {
                    "run": run.id,
                    "state": run.state.value,
                    "step": run.step,
                    "steps": run.config["total_steps"],
                    "answers": counted.given,
                    "budget": counted.budget,
                    "return": last,
                }
            )
    if as_json:
        typer.echo(json.dumps(rows))
        return
    table = table_of_names("Run", "State", "Step", "Answers", "Last return")
    for row in rows:
        last_return = "–" if row["return"] is None else f"{row['return']:.1f}"
        table.add_row(
            str(row["run"]),
            str(row["state"]),
            f"{row['step']:,} of {row['steps']:,}",
            f"{row['answers']} of {row['budget']}",
            last_return,
        )
    plain_console().print(
        table if rows else "No runs yet. Start one with `pebble train` or from the dashboard."
    )
