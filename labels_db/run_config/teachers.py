"""Who answers."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from labels_db.run_config.base import Config


class Human(Config):
    """People, on the labelling page."""

    kind: Literal["human"] = "human"
    answers_needed: int = Field(1, ge=1, le=20, description="People who answer each query; they average.")


class Scripted(Config):
    """A teacher who knows the true reward and has a person's faults (B-Pref, Lee et al. 2021).

    Every kind has every fault; kinds differ in which of them is not zero to begin with. Thresholds are shares
    of what a segment earns on average, from the last ten episodes before its session.
    """

    rationality: float | None = Field(
        None,
        gt=0,
        le=1000,
        description="β: chance decides by softmax(β · true returns); empty: the larger is preferred.",
    )
    discount: float = Field(
        1.0,
        gt=0,
        le=1,
        description="γ of a teacher who forgets: steps before the last one count γ less each.",
    )
    mistake: float = Field(0.0, ge=0, le=1, description="ε_mistake: chance that the other one is preferred.")
    skip: float = Field(
        0.0, ge=0, le=1, description="ε_skip: 'cannot tell' unless one of the two earns more than this share."
    )
    equal: float = Field(
        0.0, ge=0, le=1, description="ε_equal: 'equal' when the two earn about the same, within this share."
    )
    tie: Literal["equal", "first"] = Field(
        "equal", description="What exactly equal returns are called; the authors' code says first."
    )


class Oracle(Scripted):
    """A scripted teacher who always prefers the larger true return; a tie is equal."""

    kind: Literal["oracle"] = "oracle"


class Stochastic(Scripted):
    """A scripted teacher who prefers the larger true return the more surely the larger it is."""

    kind: Literal["stochastic"] = "stochastic"
    rationality: float | None = Field(
        1.0, gt=0, le=1000, description=Scripted.model_fields["rationality"].description
    )


class Mistaken(Scripted):
    """A scripted teacher who presses the wrong key one time in ten."""

    kind: Literal["mistake"] = "mistake"
    mistake: float = Field(0.1, ge=0, le=1, description=Scripted.model_fields["mistake"].description)


class Skipping(Scripted):
    """A scripted teacher who cannot tell when both segments earn little."""

    kind: Literal["skip"] = "skip"
    skip: float = Field(0.1, ge=0, le=1, description=Scripted.model_fields["skip"].description)


class Equal(Scripted):
    """A scripted teacher who calls segments equal that earn about the same."""

    kind: Literal["equal"] = "equal"
    equal: float = Field(0.1, ge=0, le=1, description=Scripted.model_fields["equal"].description)


class Myopic(Scripted):
    """A scripted teacher who mostly judges by the end of a segment."""

    kind: Literal["myopic"] = "myopic"
    discount: float = Field(0.9, gt=0, le=1, description=Scripted.model_fields["discount"].description)


class InstalledTeacher(Scripted):
    """A scripted teacher that an installed package offers; it may heed the faults, or have its own."""

    kind: Literal["installed"] = "installed"
    name: str = Field("", description="What the package calls it.")


TeacherConfig = Annotated[
    Human | Oracle | Stochastic | Mistaken | Skipping | Equal | Myopic | InstalledTeacher,
    Field(discriminator="kind"),
]
