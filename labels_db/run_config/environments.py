"""Where the robot is and what it could be rewarded for."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field, ValidationInfo, field_validator

from labels_db.catalogue import catalogue, entry
from labels_db.run_config.base import Config, is_recorded

ActionRepeat = Annotated[
    int, Field(ge=1, le=16, description="Control steps that each action is held for; 1 in the paper.")
]


class InCatalogue(Config):
    """An environment that the catalogue knows as `kind:what`, where `what` is the value of one field."""

    what: ClassVar[str] = "task"

    @field_validator("task", "behaviour", "id", "environment", check_fields=False)
    @classmethod
    def _is_known(cls, what: str, info: ValidationInfo) -> str:
        if not is_recorded(info):
            entry(f"{cls.model_fields['kind'].default}:{what}")
        return what

    @property
    def name(self) -> str:
        """As in `dmc:walker-walk`."""
        kind = type(self).model_fields["kind"].default
        return f"{kind}:{getattr(self, self.what)}"

    @property
    def is_known(self) -> bool:
        """False where the catalogue has lost it since it was recorded."""
        return self.name in catalogue()


class DMControl(InCatalogue):
    """A task of the dm_control suite, with its own reward."""

    kind: Literal["dmc"] = "dmc"
    task: str = Field("walker-walk", description="Domain and task of the suite, as in walker-walk.")
    action_repeat: ActionRepeat = 1


class Behaviour(InCatalogue):
    """A wish put as a reward over the simulator, for scripted teachers to stand in for a person."""

    what: ClassVar[str] = "behaviour"
    kind: Literal["behaviour"] = "behaviour"
    behaviour: str = Field(
        "cartpole-windmill-clockwise", description="Which behaviour, as in cartpole-windmill-clockwise."
    )
    action_repeat: ActionRepeat = 1


class MetaWorld(InCatalogue):
    """A manipulation task of Meta-world, its reset and goal drawn anew every episode."""

    kind: Literal["metaworld"] = "metaworld"
    task: str = Field("drawer-close", description="Which task, as in drawer-close.")
    goal_visible: bool = Field(False, description="Whether observations hold the goal; no in the paper.")
    action_repeat: ActionRepeat = 1


class Gymnasium(InCatalogue):
    """Any environment registered with Gymnasium that takes continuous actions."""

    what: ClassVar[str] = "id"
    kind: Literal["gym"] = "gym"
    id: str = Field("Hopper-v5", description="What Gymnasium knows it by, as in Hopper-v5.")
    action_repeat: ActionRepeat = 1


class InstalledEnvironment(InCatalogue):
    """An environment that an installed package offers."""

    what: ClassVar[str] = "environment"
    kind: Literal["installed"] = "installed"
    environment: str = Field("", description="What the package calls it.")
    action_repeat: ActionRepeat = 1

    @field_validator("environment")
    @classmethod
    def _is_known(cls, what: str, info: ValidationInfo) -> str:
        """None is named to begin with: there may be none installed."""
        return super()._is_known(what, info) if what else what


EnvironmentConfig = Annotated[
    DMControl | Behaviour | MetaWorld | Gymnasium | InstalledEnvironment, Field(discriminator="kind")
]
