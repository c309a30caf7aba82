"""Where the robot is and what it could be rewarded for."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, field_validator

from labels_db.catalogue import entry
from labels_db.run_config.base import Config

ActionRepeat = Annotated[
    int, Field(ge=1, le=16, description="Control steps that each action is held for; 1 in the paper.")
]


class DMControl(Config):
    """A task of the dm_control suite, with its own reward."""

    kind: Literal["dmc"] = "dmc"
    task: str = Field("walker-walk", description="Domain and task of the suite, as in walker-walk.")
    action_repeat: ActionRepeat = 1

    @field_validator("task")
    @classmethod
    def _is_known(cls, task: str) -> str:
        entry(f"dmc:{task}")
        return task

    @property
    def name(self) -> str:
        return f"dmc:{self.task}"


class Behaviour(Config):
    """A wish put as a reward over the simulator, for scripted teachers to stand in for a person."""

    kind: Literal["behaviour"] = "behaviour"
    behaviour: str = Field(
        "cartpole-windmill-clockwise", description="Which behaviour, as in cartpole-windmill-clockwise."
    )
    action_repeat: ActionRepeat = 1

    @field_validator("behaviour")
    @classmethod
    def _is_known(cls, behaviour: str) -> str:
        entry(f"behaviour:{behaviour}")
        return behaviour

    @property
    def name(self) -> str:
        return f"behaviour:{self.behaviour}"


class MetaWorld(Config):
    """A manipulation task of Meta-world, its reset and goal drawn anew every episode."""

    kind: Literal["metaworld"] = "metaworld"
    task: str = Field("drawer-close", description="Which task, as in drawer-close.")
    goal_visible: bool = Field(False, description="Whether observations hold the goal; no in the paper.")
    action_repeat: ActionRepeat = 1

    @field_validator("task")
    @classmethod
    def _is_known(cls, task: str) -> str:
        entry(f"metaworld:{task}")
        return task

    @property
    def name(self) -> str:
        return f"metaworld:{self.task}"


class Gymnasium(Config):
    """Any environment registered with Gymnasium that takes continuous actions."""

    kind: Literal["gym"] = "gym"
    id: str = Field("Hopper-v5", description="What Gymnasium knows it by, as in Hopper-v5.")
    action_repeat: ActionRepeat = 1

    @field_validator("id")
    @classmethod
    def _is_known(cls, id: str) -> str:
        entry(f"gym:{id}")
        return id

    @property
    def name(self) -> str:
        return f"gym:{self.id}"


class InstalledEnvironment(Config):
    """An environment that an installed package offers."""

    kind: Literal["installed"] = "installed"
    environment: str = Field("", description="What the package calls it.")
    action_repeat: ActionRepeat = 1

    @field_validator("environment")
    @classmethod
    def _is_known(cls, environment: str) -> str:
        if environment:
            entry(f"installed:{environment}")
        return environment

    @property
    def name(self) -> str:
        return f"installed:{self.environment}"


EnvironmentConfig = Annotated[
    DMControl | Behaviour | MetaWorld | Gymnasium | InstalledEnvironment, Field(discriminator="kind")
]
