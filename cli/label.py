"""`pebble label`: a scripted teacher that leases and answers through the HTTP API, as a person would."""

from __future__ import annotations

import json
import time
import uuid
from collections.abc import Iterator
from http.cookiejar import CookieJar
from itertools import islice
from typing import Any
from urllib.error import HTTPError, URLError
from urllib.parse import quote
from urllib.request import HTTPCookieProcessor, Request, build_opener

import typer

from cli.errors import UsageError
from cli.settings import by_name
from labels_db.answers import pressed_for
from labels_db.data_folder import DataFolder
from labels_db.database import Database
from labels_db.models import Lease
from labels_db.overrides import SettingError, with_settings
from labels_db.run_config import RunConfig, Scripted, Sessions
from labels_db.runs import config_of, get_run
from server.token import access_token
from trainer.teachers import ScriptedTeacher, scripted_teacher_named

WAIT_SECONDS = 0.5


class Client:
    """The API with this installation's token; raises UsageError with the server's reason."""

    def __init__(self, url: str, token: str) -> None:
        self.url = url.rstrip("/")
        self._headers = {"Authorization": f"Bearer {token}", "Content-Type": "application/json"}
        self._opener = build_opener(HTTPCookieProcessor(CookieJar()))

    def send(self, method: str, path: str, body: dict[str, Any]) -> dict[str, Any]:
        request = Request(f"{self.url}{path}", json.dumps(body).encode(), self._headers, method=method)
        try:
            with self._opener.open(request, timeout=30) as reply:
                found: dict[str, Any] = json.load(reply)
                return found
        except HTTPError as error:
            raise UsageError(
                f"{method} {path}: {error.code} {error.read().decode(errors='replace')}"
            ) from error
        except URLError as error:
            raise UsageError(
                f"{self.url}: no server answers there ({error.reason}); start `pebble up`"
            ) from error


def chosen_teacher(kind: str, settings: list[str]) -> Scripted:
    """The scripted teacher of that kind with those faults; UsageError names the option that is wrong."""
    try:
        scripted_teacher_named(kind)
    except ValueError as error:
        raise UsageError(f"--teacher {error}") from error
    given = by_name(settings, "NAME=VALUE, as in --set equal=0.1")
    if "kind" in given:
        raise UsageError(f"--set kind={given['kind']}: choose it by --teacher")
    changes = {f"feedback.teacher.{name}": value for name, value in {"kind": kind, **given}.items()}
    try:
        feedback = with_settings(RunConfig(), changes).feedback
    except SettingError as error:
        raise UsageError(f"--set {error.path.removeprefix('feedback.teacher.')}: {error.message}") from error
    assert isinstance(feedback, Sessions)
    assert isinstance(feedback.teacher, Scripted)
    return feedback.teacher


def label_run(
    run_id: str,
    data: DataFolder,
    teacher: str,
    settings: list[str],
    url: str,
    seconds: float,
    answers: int | None,
) -> None:
    """Answer until the run wants no more, or `answers` have been given."""
    config = chosen_teacher(teacher, settings)
    client, address = Client(url, access_token(data)), f"/api/runs/{quote(run_id)}/answers"
    client.send("PUT", "/api/labeller", {"name": f"{teacher} (scripted)"})
    given = 0
    with data.open_database() as database:
        scripted = ScriptedTeacher(config, data.open_store(), _seed(database, run_id))
        for given, lease in enumerate(islice(_leases(client, run_id), answers), start=1):
            time.sleep(seconds)
            client.send("POST", address, _answer(database, lease["lease_id"], scripted))
            typer.echo(f"\r{given} answers", nl=False, err=True)
    typer.echo(f"\n{given} answers given.", err=True)


def _leases(client: Client, run_id: str) -> Iterator[dict[str, Any]]:
    """One lease at a time, waiting while there is none, until there will be no more."""
    while True:
        reply = client.send("POST", f"/api/runs/{quote(run_id)}/leases", {"count": 1})
        message = reply["queue"]["message"]
        if reply["leases"]:
            yield reply["leases"][0]
        elif message and message["over"]:
            return
        else:
            time.sleep(WAIT_SECONDS)


def _seed(database: Database, run_id: str) -> int:
    with database.read() as session:
        return config_of(get_run(session, run_id)).seed


def _answer(database: Database, lease_id: int, teacher: ScriptedTeacher) -> dict[str, Any]:
    """What the teacher presses: true rewards and sides come from the record, never over HTTP."""
    with database.read() as session:
        lease = session.get_one(Lease, lease_id)
        pressed = pressed_for(teacher(lease.query), swapped=lease.swapped)
    return {"answer_id": str(uuid.uuid4()), "lease_id": lease_id, "pressed": pressed.value, "count": 0}
