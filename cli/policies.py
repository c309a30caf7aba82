"""`pebble evaluate`, `export-policy`, `replay`."""

from __future__ import annotations

import json
from pathlib import Path

import typer

from labels_db.data_folder import DataFolder
from labels_db.runs import config_of, get_run


def evaluate_run(run_id: str, data: DataFolder, episodes: int, seed: int | None, *, as_json: bool) -> None:
    """Mean return and measures of the run's last policy."""
    from trainer.commands import evaluation_of
    from trainer.policy import load_policy

    with data.open_database() as database:
        policy = load_policy(database, data.open_store(), run_id)
    result = {"run": run_id, **evaluation_of(policy, episodes, policy.config.seed if seed is None else seed)}
    if as_json:
        typer.echo(json.dumps(result))
        return
    measures = "".join(f", {name} {value:.1f}" for name, value in result["measures"].items())
    typer.echo(
        f"{run_id} at step {result['step']:,}, {episodes} episodes: return {result['return']:.1f}{measures}"
    )


def export_run(run_id: str, data: DataFolder, file: str) -> None:
    """Write the policy to the file, in the format of its ending."""
    from trainer.export import export_policy
    from trainer.policy import load_policy

    with data.open_database() as database:
        policy = load_policy(database, data.open_store(), run_id)
    export_policy(policy, Path(file))
    typer.echo(f"{file}: policy of {run_id} at step {policy.step:,}")


def replay_run(run_id: str, data: DataFolder, *, as_json: bool) -> int:
    """Repeat the run; 0 when its weights come out the same."""
    from trainer.replay import replay

    with data.open_database() as database:
        with database.read() as session:
            config = config_of(get_run(session, run_id))
        with typer.progressbar(length=config.total_steps, label="replaying", hidden=as_json) as bar:
            result = replay(database, data.open_store(), run_id, bar.update)
    if as_json:
        typer.echo(json.dumps(result.as_dict()))
    else:
        typer.echo(result.sentence())
    return 0 if result.same else 1
