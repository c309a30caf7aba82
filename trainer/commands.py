"""Commands of ended runs: `python -m trainer.commands COMMAND_ID DATA [ARTIFACTS_URL]`."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import structlog

from labels_db import commands
from labels_db.data_folder import DataFolder
from labels_db.database import Database
from labels_db.errors import RecordError
from labels_db.models import Command
from labels_db.policy_commands import keep_video
from labels_db.records import evaluation_at
from labels_db.storage import ArtifactError, ArtifactStore
from trainer.checkpoints import CheckpointError
from trainer.environments import make_environment
from trainer.evaluation import EvaluationError, evaluate, mean_measures, returns_of
from trainer.export import ExportError, export_policy
from trainer.policy import TrainedPolicy, load_policy
from trainer.rendering import VIDEO_SECONDS, Renderer, RenderingError, drawn

log = structlog.get_logger()


def evaluation_of(policy: TrainedPolicy, episodes: int, seed: int) -> dict[str, Any]:
    """Mean true return and measures of the policy over fresh episodes."""
    environment = make_environment(policy.config.environment)
    lived = evaluate(policy, environment, seed=seed, episodes=episodes)
    returns = returns_of(lived)
    return {
        "environment": policy.config.environment.name,
        "step": policy.step,
        "episodes": episodes,
        "return": sum(returns) / len(returns),
        "returns": returns,
        "measures": mean_measures(lived),
    }


@dataclass(frozen=True)
class Record:
    """Where what comes of a command is kept."""

    database: Database
    store: ArtifactStore


def _evaluate(command: Command, policy: TrainedPolicy, _record: Record) -> dict[str, Any]:
    return evaluation_of(policy, command.arguments["episodes"], policy.config.seed)


def _video(command: Command, policy: TrainedPolicy, record: Record) -> dict[str, Any]:
    """Draw the first episode of the run's own evaluations; where its step has none, that one is lived through too."""
    config, environment = policy.config, make_environment(policy.config.environment)
    with record.database.read() as session:
        evaluated = evaluation_at(session, command.run_id, policy.step) is not None
    episodes = 1 if evaluated else config.evaluation.episodes
    lived = evaluate(policy, environment, seed=config.seed, episodes=episodes)
    returns = returns_of(lived)
    key = f"runs/{command.run_id}/videos/c{command.id}-{policy.step}.mp4"
    with Renderer(config.environment, config.clips) as renderer:
        video = renderer.video(lived[0].seed, lived[0].states, environment.control_step)
        record.store.write(key, drawn(video, VIDEO_SECONDS))
    try:
        with record.database.write() as session:
            keep_video(
                session,
                command.run_id,
                step=policy.step,
                returns=returns,
                measures=mean_measures(lived),
                video_key=key,
            )
    except RecordError:
        record.store.delete(key)
        raise
    return {"step": policy.step}


def _export(command: Command, policy: TrainedPolicy, record: Record) -> dict[str, Any]:
    ending = command.arguments["format"]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{command.run_id}-step-{policy.step}.{ending}"
        export_policy(policy, path)
        data = path.read_bytes()
    key = f"runs/{command.run_id}/exports/{command.id}/{path.name}"
    return {"artifact": key, "sha256": record.store.write(key, data), "step": policy.step, "bytes": len(data)}


DOERS: Mapping[str, Callable[[Command, TrainedPolicy, Record], dict[str, Any]]] = MappingProxyType(
    {"evaluate": _evaluate, "video": _video, "export-policy": _export}
)


def do(command: Command, database: Database, store: ArtifactStore) -> dict[str, Any]:
    """What came of it: its result, or the reason why there is none."""
    try:
        return DOERS[command.kind](
            command, load_policy(database, store, command.run_id), Record(database, store)
        )
    except (
        ArtifactError,
        CheckpointError,
        EvaluationError,
        ExportError,
        RecordError,
        RenderingError,
    ) as error:
        return {"error": str(error)}
    except Exception as error:  # the asker must hear of it, whatever it is
        log.exception("command failed", kind=command.kind, run=command.run_id)
        return {"error": f"{type(error).__name__}: {error}"}


def main(arguments: list[str]) -> int:
    command_id, path, *url = arguments
    data = DataFolder(Path(path), url[0] if url else None)
    store = data.open_store()
    with data.open_database() as database:
        with database.read() as session:
            command = session.get_one(Command, int(command_id))
        result = do(command, database, store)
        with database.write() as session:
            commands.finish(session, command.id, result)
    return 1 if "error" in result else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
