"""docker-compose.yml: valid by the specification's schema, closed to the network, and its commands do run."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.error import URLError
from urllib.request import urlopen

import jsonschema
import pytest
import yaml

ROOT = Path(__file__).parents[2]
COMPOSE: dict[str, Any] = yaml.safe_load((ROOT / "docker-compose.yml").read_text(encoding="utf-8"))
SERVICES: dict[str, dict[str, Any]] = COMPOSE["services"]
DOCKERFILE = (ROOT / "Dockerfile").read_text(encoding="utf-8")


def test_the_file_is_what_the_specification_allows() -> None:
    schema = json.loads((Path(__file__).parent / "compose-spec.json").read_text(encoding="utf-8"))
    validator = jsonschema.Draft201909Validator(schema)
    assert [error.message for error in validator.iter_errors(COMPOSE)] == []
    assert list(validator.iter_errors({"services": {"server": {"comand": "x"}}}))


def test_there_is_a_server_and_a_trainer_on_one_image_and_one_volume() -> None:
    assert set(SERVICES) == {"server", "trainer"}
    assert {service["image"] for service in SERVICES.values()} == {"pebble"}
    assert list(COMPOSE["volumes"]) == ["data"]
    for service in SERVICES.values():
        assert service["volumes"] == ["data:/data"]
        assert service["environment"]["PEBBLE_DATA"] == "/data"
        assert service["restart"] == "unless-stopped"
        assert service["healthcheck"]["test"][0] == "CMD"


def test_only_this_machine_reaches_the_server() -> None:
    assert SERVICES["server"]["ports"] == ["127.0.0.1:8000:8000"]
    assert "ports" not in SERVICES["trainer"]
    assert all("network_mode" not in service for service in SERVICES.values())


def test_the_image_runs_as_a_user_who_owns_the_data() -> None:
    users = re.findall(r"^USER (\S+)", DOCKERFILE, re.MULTILINE)
    assert users == ["pebble"]
    assert "--owner=pebble --group=pebble /data" in DOCKERFILE
    assert DOCKERFILE.index("USER pebble") < DOCKERFILE.index("CMD [")


def test_the_image_renders_with_what_a_machine_renders_with() -> None:
    setup = (ROOT / "scripts" / "setup").read_text(encoding="utf-8")
    (packages,) = re.findall(r" echo (libegl1 [^;\n]*)", setup)
    assert f"--no-install-recommends {packages} " in DOCKERFILE


def test_the_image_holds_the_product_and_nothing_else() -> None:
    allowed = {
        line[1:] for line in (ROOT / ".dockerignore").read_text(encoding="utf-8").split() if line[0] == "!"
    }
    packages = {"labels_db", "server", "trainer", "web", "cli"}
    assert allowed == packages | {"pyproject.toml", "README.md", "LICENSE"}


# Each service's own command, here instead of in a container -----------------------------------------


@pytest.fixture
def port() -> int:
    """A port that was free a moment ago."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])


@contextmanager
def _service(name: str, data: Path, *more: str) -> Iterator[subprocess.Popen[bytes]]:
    with subprocess.Popen(_words(SERVICES[name]["command"]) + list(more), env=_environment(data)) as process:
        try:
            yield process
        finally:
            process.kill()


def _words(command: list[str]) -> list[str]:
    """The command with this environment's programs."""
    return [str(Path(sys.executable).parent / command[0]), *command[1:]]


def _environment(data: Path) -> dict[str, str]:
    return {**os.environ, "PEBBLE_DATA": str(data)}


def _healthy(name: str, data: Path, port: int = 8000) -> bool:
    """What the service's health check says, asked the way the container engine asks."""
    test = [word.replace(":8000/", f":{port}/") for word in SERVICES[name]["healthcheck"]["test"][1:]]
    return subprocess.run(_words(test), env=_environment(data), capture_output=True).returncode == 0


def _becomes(true: Callable[[], bool], process: subprocess.Popen[bytes]) -> bool:
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and process.poll() is None:
        if true():
            return True
        time.sleep(0.2)
    return False


def _ends_cleanly(process: subprocess.Popen[bytes]) -> bool:
    process.send_signal(signal.SIGTERM)
    return process.wait(timeout=30) in (0, -signal.SIGTERM)


def _answers(port: int) -> bool:
    try:
        with urlopen(f"http://127.0.0.1:{port}/healthz", timeout=3) as response:
            return bool(response.status == 200)
    except URLError:
        return False


def test_the_server_serves_and_ends_when_told(tmp_path: Path, port: int) -> None:
    assert not _healthy("server", tmp_path, port)
    with _service("server", tmp_path, "--port", str(port)) as process:
        assert _becomes(lambda: _answers(port), process)
        assert _healthy("server", tmp_path, port)
        assert _ends_cleanly(process)
    assert (tmp_path / "pebble.db").exists()


def test_the_trainer_is_healthy_and_ends_when_told(tmp_path: Path) -> None:
    assert not _healthy("trainer", tmp_path)
    with _service("trainer", tmp_path) as process:
        assert _becomes(lambda: _healthy("trainer", tmp_path), process)
        assert _ends_cleanly(process)
