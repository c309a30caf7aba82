"""What the API takes, described for its OpenAPI document."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import Path
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints, model_validator

from labels_db.policy_commands import TAKES, PolicyCommand

LARGEST = 2**53 - 1
"""The largest integer that every JSON reader keeps whole."""

RunId = Annotated[str, Path(max_length=200, description="The run's id.", examples=["walker-walk-3fa2b1"])]
ExperimentName = Annotated[
    str, Path(max_length=200, description="The experiment's name.", examples=["laptop"])
]
Count = Annotated[int, Path(ge=0, le=LARGEST)]


def _readable(text: str) -> str:
    if any(ord(letter) < 32 and letter not in "\t\r\n" for letter in text):
        raise ValueError("may not have control characters in it")
    return text


Title = Annotated[
    str, StringConstraints(strip_whitespace=True, min_length=1, max_length=120), AfterValidator(_readable)
]
GoalText = Annotated[
    str, StringConstraints(strip_whitespace=True, min_length=1, max_length=1000), AfterValidator(_readable)
]


class Asked(BaseModel):
    """What a client sends; keys that are not known are refused."""

    model_config = ConfigDict(extra="forbid")


class NewRun(Asked):
    """A run to be queued."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "preset": "cartpole-windmill-clockwise",
                    "settings": {"feedback.budget": "40", "feedback.teacher.kind": "oracle", "seed": "2"},
                }
            ]
        }
    )

    preset: str = Field(description="Name of a preset, as `GET /api/presets` lists them.")
    profile: str | None = Field(None, description="Profile of the preset; the first one when absent.")
    title: Title | None = Field(None, description="What to call the run; the preset's title when absent.")
    goal: GoalText | None = Field(None, description="What labellers look for; the preset's when absent.")
    settings: dict[str, str] = Field(
        default={}, description='Values by path, as `--set` takes them; `""` empties an optional one.'
    )


class Extension(Asked):
    """More of a run: new totals, not additions."""

    total_steps: int | None = Field(None, ge=1, le=LARGEST, examples=[80_000])
    budget: int | None = Field(None, ge=1, le=LARGEST, description="Answers in all.", examples=[100])


class NewGoal(Asked):
    """Better words for what labellers look for."""

    text: GoalText = Field(examples=["Prefer the clip in which the pole turns faster and more evenly."])


class NewCommand(Asked):
    """Something to be done with the last policy of a run that has ended."""

    kind: PolicyCommand
    episodes: int | None = Field(
        None, ge=1, le=100, description=f"With `evaluate` only; {TAKES['evaluate']['episodes']} when absent."
    )
    format: Literal["onnx", "safetensors"] | None = Field(
        None, description=f"With `export-policy` only; {TAKES['export-policy']['format']} when absent."
    )

    @model_validator(mode="after")
    def _nothing_idle(self) -> NewCommand:
        for name in self.arguments:
            if name not in TAKES[self.kind]:
                raise ValueError(f"{self.kind} takes no {name}; leave it out")
        return self

    @property
    def arguments(self) -> dict[str, Any]:
        """What it was told."""
        told = {"episodes": self.episodes, "format": self.format}
        return {name: value for name, value in told.items() if value is not None}
