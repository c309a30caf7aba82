"""Somebody at the labelling API of one run."""

from __future__ import annotations

import uuid
from contextlib import AbstractContextManager
from typing import Any

from fastapi.testclient import TestClient

from labels_db.data_folder import DataFolder
from server.app import create_app
from server.token import access_token

RUN = "/api/runs/mill"


def new_id() -> str:
    return str(uuid.uuid4())


def client(data: DataFolder, name: str) -> AbstractContextManager[TestClient]:
    """A client that is signed in and goes by a name."""
    made = TestClient(create_app(data), base_url="http://127.0.0.1")
    made.headers["Authorization"] = f"Bearer {access_token(data)}"
    made.cookies.set("pebble_labeller", name)
    return made


def lease(who: TestClient, count: int = 1) -> list[dict[str, Any]]:
    reply = who.post(f"{RUN}/leases", json={"count": count})
    assert reply.status_code == 200, reply.text
    leases: list[dict[str, Any]] = reply.json()["leases"]
    return leases


def answer(who: TestClient, lease_id: int, pressed: str = "left", **more: Any) -> Any:
    body = {"answer_id": new_id(), "lease_id": lease_id, "pressed": pressed, **more}
    return who.post(f"{RUN}/answers", json=body)


def reason(reply: Any) -> dict[str, str]:
    said: dict[str, str] = reply.json()["detail"][0]
    return said
