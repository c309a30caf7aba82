"""The `pebble` command. Each command imports what it needs when it runs, so that `--help` stays instant."""

from __future__ import annotations

import sys
from importlib.metadata import version
from pathlib import Path
from typing import Annotated

import typer

from cli.errors import explain
from cli.options import Data, Json, RunId, Seed

app = typer.Typer(
    name="pebble",
    help="Teach a simulated robot by choosing between pairs of one-second clips.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"pebble {version('pebble-teach')}")
        raise typer.Exit


@app.callback()
def pebble(
    _version_wanted: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Teach a simulated robot by choosing between pairs of one-second clips."""


# Serving -----------------------------------------------------------------------------------------

Host = Annotated[
    str, typer.Option(help="Address to listen on; anything but this machine is your own choice.")
]
Port = Annotated[int, typer.Option(min=0, max=65535, help="Port to listen on; 0 takes a free one.")]
AllowHost = Annotated[list[str] | None, typer.Option(help="A name the server answers to, besides its own.")]
Parallel = Annotated[
    int | None, typer.Option(min=1, help="Runs at a time; by default one for every two cores.")
]


@app.command()
def up(
    data: Data,
    host: Host = "127.0.0.1",
    port: Port = 8000,
    allow_host: AllowHost = None,
    max_parallel_runs: Parallel = None,
) -> None:
    """Start everything: the pages and the supervisor of runs."""
    from cli.serving import bring_up

    bring_up(data, host, port, allow_host or [], max_parallel_runs)


@app.command()
def serve(data: Data, host: Host = "127.0.0.1", port: Port = 8000, allow_host: AllowHost = None) -> None:
    """Start the pages only; runs need `pebble supervise` somewhere on the same data."""
    from cli.serving import serve_pages

    serve_pages(data, host, port, allow_host or [])


@app.command()
def supervise(
    data: Data,
    max_parallel_runs: Parallel = None,
    parent: Annotated[int | None, typer.Option(hidden=True)] = None,
) -> None:
    """Start the supervisor only: it claims queued runs and gives each a process."""
    from cli.serving import supervise_runs

    supervise_runs(data, max_parallel_runs, parent)


@app.command()
def healthy(data: Data) -> None:
    """Exit with 0 while a supervisor looks after this data folder."""
    from cli.serving import require_supervisor

    require_supervisor(data)


@app.command()
def token(
    data: Data,
    renew: Annotated[
        bool, typer.Option("--renew", help="Make a new one; everybody must sign in again.")
    ] = False,
) -> None:
    """Print the access token."""
    from server.token import access_token, renew_token

    typer.echo(renew_token(data) if renew else access_token(data))


# Runs --------------------------------------------------------------------------------------------


@app.command()
def train(
    preset: Annotated[
        str,
        typer.Argument(
            help="A preset, as `pebble presets` lists them, or an environment, as in gym:Hopper-v5."
        ),
    ],
    data: Data,
    profile: Annotated[
        str | None, typer.Option(help="laptop, paper, public or few-labels, as the preset has them.")
    ] = None,
    teacher: Annotated[str | None, typer.Option(help="Who answers: human, or a scripted teacher.")] = None,
    method: Annotated[
        str | None, typer.Option(help="How it learns, as `pebble methods` lists; pebble by default.")
    ] = None,
    labels: Annotated[int | None, typer.Option(min=1, help="Answers in all.")] = None,
    steps: Annotated[int | None, typer.Option(min=1, help="Steps in all.")] = None,
    seed: Seed = None,
    setting: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="PATH=VALUE", help="Any setting, as docs/configuration.md lists."),
    ] = None,
    json: Json = False,
) -> None:
    """Train one run here, in the foreground."""
    from cli.train import chosen_config, train_here

    shortcuts = {
        "feedback.teacher.kind": teacher,
        "feedback.budget": labels,
        "total_steps": steps,
        "seed": seed,
    }
    config = chosen_config(preset, profile, shortcuts, setting or [], method)
    sys.exit(train_here(preset, config, data, method=method, as_json=json))


ExperimentFile = Annotated[Path, typer.Argument(help="A YAML file, as docs/experiments.md describes.")]


@app.command()
def experiment(
    file: ExperimentFile,
    data: Data,
    parallel: Annotated[
        int | None, typer.Option(min=1, help="Runs at a time, one thread each; by default one a core.")
    ] = None,
    join: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FOLDER", help="Results of another machine: what finished there is not run again."
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Run methods × tasks × seeds; run it again after any end to go on."""
    from cli.experiment import live_through
    from trainer.cores import available_cores

    sys.exit(live_through(file, data, parallel or available_cores(), join or [], as_json=json))


@app.command()
def plot(
    file: ExperimentFile,
    data: Data,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the figures; by default beside the results.")
    ] = None,
    results: Annotated[
        Path | None,
        typer.Option(help="Folder with results.parquet to draw from, instead of the data folder's runs."),
    ] = None,
) -> None:
    """Draw an experiment's figures from its results."""
    from cli.experiment import plot as draw

    draw(file, data, out, results)


@app.command()
def methods(json: Json = False) -> None:
    """List the methods that can be compared."""
    from cli.experiment import list_methods

    list_methods(as_json=json)


@app.command()
def runs(data: Data, json: Json = False) -> None:
    """List the runs."""
    from cli.listing import list_runs

    list_runs(data, as_json=json)


@app.command()
def presets(json: Json = False) -> None:
    """List the presets and their profiles."""
    from cli.listing import list_presets

    list_presets(as_json=json)


@app.command()
def environments(
    data: Data,
    add: Annotated[
        str | None, typer.Option(metavar="gym:ID", help="Try this one and add it to the data folder's.")
    ] = None,
    title: Annotated[
        str | None, typer.Option(help="What the added one is called; its id by default.")
    ] = None,
    goal: Annotated[str | None, typer.Option(help="What people look for in its clips.")] = None,
    json: Json = False,
) -> None:
    """List the environments that runs can be in, or add one that Gymnasium knows."""
    from cli.environments import add_environment, list_environments

    if add is not None:
        add_environment(add, data, title, goal)
    else:
        list_environments(as_json=json)


@app.command()
def evaluate(
    run: RunId,
    data: Data,
    episodes: Annotated[int, typer.Option(min=1, max=1000, help="Episodes to average over.")] = 10,
    seed: Seed = None,
    json: Json = False,
) -> None:
    """Evaluate the policy of a run's last checkpoint on fresh episodes."""
    from cli.policies import evaluate_run

    evaluate_run(run, data, episodes, seed, as_json=json)


@app.command(name="export-policy")
def export_policy(
    run: RunId,
    file: Annotated[str, typer.Argument(help="FILE.onnx, or FILE.safetensors with its layout in FILE.json.")],
    data: Data,
) -> None:
    """Write a run's policy so that anybody can roll it out."""
    from cli.policies import export_run

    export_run(run, data, file)


@app.command()
def replay(run: RunId, data: Data, json: Json = False) -> None:
    """Repeat a run from its configuration, seed, answers and fits, and compare the weights."""
    from cli.policies import replay_run

    sys.exit(replay_run(run, data, as_json=json))


@app.command()
def label(
    run: RunId,
    data: Data,
    teacher: Annotated[str, typer.Option(help="The scripted teacher that answers.")] = "oracle",
    setting: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="A setting of the teacher, as in mistake=0.1."),
    ] = None,
    url: Annotated[str, typer.Option(help="Where the server is.")] = "http://127.0.0.1:8000",
    seconds: Annotated[float, typer.Option(min=0, help="Time taken for each answer.")] = 0.0,
    answers: Annotated[
        int | None, typer.Option(min=1, help="Stop after so many; by default when none are wanted.")
    ] = None,
) -> None:
    """Let a scripted teacher answer a run's queries through the HTTP API, as a person would."""
    from cli.label import label_run

    label_run(run, data, teacher, setting or [], url, seconds, answers)


@app.command()
def doctor(data: Data) -> None:
    """Check this machine: render a frame, open the database, compare versions; says what to do."""
    from cli.doctor import examine

    sys.exit(examine(data))


def main() -> None:
    """Entry point: what users can mend is said in one line, not as a traceback."""
    with explain():
        app()
