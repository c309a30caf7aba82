"""What a page offers for an ended run's policy, each beside what came of asking it last."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from sqlalchemy.orm import Session

from labels_db.models import ENDED, Command, Run
from labels_db.policy_commands import TAKES, PolicyCommand, policy_commands_of, video_missing
from labels_db.records import checkpoints_of
from server.command_words import command_sentence, download_url, error_of

OPERATOR = "operator"
"""Who asks through pages and API: whoever holds the token."""

COMMANDS_SHOWN = 20


@dataclass(frozen=True)
class Button:
    """What it says, what it is for, and what it sends."""

    label: str
    purpose: str
    kind: PolicyCommand
    arguments: Mapping[str, Any] = field(default_factory=dict)


EPISODES = TAKES["evaluate"]["episodes"]

BUTTONS = (
    Button(
        f"Evaluate again ({EPISODES} episodes)",
        "How well it does over more episodes.",
        "evaluate",
        {"episodes": EPISODES},
    ),
    Button("Make a video", "One episode of its policy, to be watched.", "video"),
    Button("Export as ONNX", "For any ONNX runtime.", "export-policy", {"format": "onnx"}),
    Button(
        "Export as safetensors",
        "Plain arrays, with their layout in the file's metadata.",
        "export-policy",
        {"format": "safetensors"},
    ),
)


@dataclass(frozen=True)
class Ask:
    """A button, and the latest command it led to."""

    button: Button
    latest: Command | None

    @property
    def going(self) -> bool:
        return self.latest is not None and self.latest.done_at is None

    @property
    def failed(self) -> bool:
        return self.latest is not None and error_of(self.latest) is not None

    @property
    def sentence(self) -> str:
        return self.button.purpose if self.latest is None else command_sentence(self.latest)

    @property
    def at(self) -> datetime | None:
        return None if self.latest is None else self.latest.done_at

    @property
    def download_url(self) -> str | None:
        return None if self.latest is None else download_url(self.latest)


def policy_asks(session: Session, run: Run) -> list[Ask] | None:
    """The buttons; none without a checkpoint, None while the run goes on."""
    if run.state not in ENDED:
        return None
    if not checkpoints_of(session, run.id):
        return []
    asked = policy_commands_of(session, run.id, limit=COMMANDS_SHOWN)
    missing = video_missing(session, run)
    offered = [button for button in BUTTONS if missing or button.kind != "video"]
    return [Ask(button, _latest(asked, button)) for button in offered]


def _latest(asked: Sequence[Command], button: Button) -> Command | None:
    """The latest of the same kind and format; an evaluation over any number of episodes tells the same."""
    wanted = (button.kind, button.arguments.get("format"))
    return next((each for each in asked if (each.kind, each.arguments.get("format")) == wanted), None)
