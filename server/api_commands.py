"""The API for what is done with an ended run's policy: evaluate it again, have it drawn, export it."""

from __future__ import annotations

from fastapi import APIRouter

from labels_db.models import Command
from labels_db.policy_commands import ask_of_policy, policy_commands_of
from labels_db.runs import get_run
from server.api_refusals import NOT_NOW, REFUSED, UNKNOWN
from server.api_replies import CommandOut
from server.api_requests import NewCommand, RunId
from server.command_words import command_sentence, download_url, error_of
from server.policy_view import COMMANDS_SHOWN, OPERATOR
from server.services import ServicesDep

router = APIRouter(prefix="/api/runs/{run_id}", tags=["commands"], responses=REFUSED | UNKNOWN)


@router.post("/commands", status_code=201, responses=NOT_NOW)
def ask(run_id: RunId, asked: NewCommand, services: ServicesDep) -> CommandOut:
    """Ask the supervisor to evaluate, draw or export the run's last policy; look again for what came of it."""
    with services.database.write() as session:
        return command_out(ask_of_policy(session, run_id, asked.kind, asked_by=OPERATOR, **asked.arguments))


@router.get("/commands")
def commands(run_id: RunId, services: ServicesDep) -> list[CommandOut]:
    """The latest 20 commands, the newest first."""
    with services.database.read() as session:
        get_run(session, run_id)
        found = policy_commands_of(session, run_id, limit=COMMANDS_SHOWN)
        return [command_out(command) for command in found]


def command_out(command: Command) -> CommandOut:
    error, result = error_of(command), command.result
    kept = None if result is None or error else {k: v for k, v in result.items() if k != "artifact"}
    return CommandOut(
        id=command.id,
        kind=command.kind,
        arguments=command.arguments,
        asked_at=command.asked_at,
        taken_at=command.taken_at,
        done_at=command.done_at,
        sentence=command_sentence(command),
        result=kept,
        error=error,
        download_url=download_url(command),
    )
