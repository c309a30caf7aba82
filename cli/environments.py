"""`pebble environments`."""

from __future__ import annotations

import json
from dataclasses import asdict

import typer

from cli.errors import UsageError
from cli.tables import plain_console, table_of_names
from labels_db.catalogue import CatalogueEntry, catalogue
from labels_db.data_folder import DataFolder


def add_environment(name: str, data: DataFolder, title: str | None, goal: str | None) -> None:
    """Try an environment of Gymnasium and add it to the folder's catalogue."""
    from trainer.environments.trial import add

    try:
        added = add(data.catalogue_path, name, title, goal)
    except (ValueError, ModuleNotFoundError) as error:
        raise UsageError(str(error)) from error
    typer.echo(f"{name}: added to {data.catalogue_path} ({_episode(added)} an episode).")
    for caveat in added.caveats:
        typer.echo(caveat)


def list_environments(*, as_json: bool) -> None:
    """Every environment that is known, with what it asks for."""
    known = sorted(catalogue().values(), key=lambda entry: entry.name)
    if as_json:
        typer.echo(json.dumps([asdict(entry) for entry in known], ensure_ascii=False))
        return
    table = table_of_names("Environment", "Observations", "Actions", "Episode", "Title")
    for entry in known:
        sizes = str(entry.observation_size), str(entry.action_size)
        table.add_row(entry.name, *sizes, _episode(entry), entry.title)
    plain_console().print(table)


def _episode(entry: CatalogueEntry) -> str:
    """How long an episode is, at most where it can end early."""
    seconds = entry.episode_steps * entry.control_step
    return ("≤ " if entry.ends_early else "") + f"{entry.episode_steps} steps, {seconds:.4g} s"
