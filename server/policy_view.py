"""What a page offers for an ended run's policy, each beside what came of asking it last."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy.orm import Session

from labels_db.models import ENDED, Command, Run
from labels_db.policy_commands import policy_commands_of, video_missing
from labels_db.records import checkpoints_of
from server.command_words import command_sentence, download_url, error_of

OPERATOR = "operator"
"""Who asks through pages and API: whoever holds the token."""

COMMANDS_SHOWN = 20


@dataclass(frozen=True)
class Ask:
    """A button: what it says, what it is for, what it sends, and the latest command it led to."""

    label: str
    purpose: str
    kind: str
    arguments: Mapping[str, Any]
    latest: Command | None = None

    @property
    def going(self) -> bool:
        return self.latest is not None and self.latest.done_at is None

    @property
    def failed(self) -> bool:
        return self.latest is not None and error_of(self.latest) is not None

    @property
    def sentence(self) -> str:
        return self.purpose if self.latest is None else command_sentence(self.latest)

    @property
    def at(self) -> datetime | None:
        return None if self.latest is None else self.latest.done_at

    @property
    def download_url(self) -> str | None:
        return None if self.latest is None else download_url(self.latest)


BUTTONS: Sequence[tuple[str, str, str, Mapping[str, Any]]] = (
    ("Evaluate again (10 episodes)", "How well it does over more episodes.", "evaluate", {"episodes": 10}),
    ("Make a video", "One episode of its policy, to be watched.", "video", {}),
    ("Export as ONNX", "For any ONNX runtime.", "export-policy", {"format": "onnx"}),
    (
        "Export as safetensors",
        "Plain arrays, with their layout in the file's metadata.",
        "export-policy",
        {"format": "safetensors"},
    ),
)


def policy_asks(session: Session, run: Run) -> list[Ask] | None:
    """The buttons; none without a checkpoint, None while the run goes on."""
    if run.state not in ENDED:
        return None
    if not checkpoints_of(session, run.id):
        return []
    asked = policy_commands_of(session, run.id, limit=COMMANDS_SHOWN)
    asks = [Ask(*button, latest=_latest(asked, *button[2:])) for button in BUTTONS]
    missing = video_missing(session, run)
    return [ask for ask in asks if missing or ask.kind != "video"]


def _latest(asked: Sequence[Command], kind: str, arguments: Mapping[str, Any]) -> Command | None:
    """The latest of the same kind and format; an evaluation over any number of episodes tells the same."""
    wanted = (kind, arguments.get("format"))
    return next((each for each in asked if (each.kind, each.arguments.get("format")) == wanted), None)
