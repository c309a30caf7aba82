"""Which queries are asked."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from labels_db.run_config.base import Config


class Uniform(Config):
    """Random pairs."""

    kind: Literal["uniform"] = "uniform"


class Disagreement(Config):
    """Pairs on whose preference the ensemble's members differ most."""

    kind: Literal["disagreement"] = "disagreement"


class Entropy(Config):
    """Pairs on which the members are least sure, on average."""

    kind: Literal["entropy"] = "entropy"


class KCenter(Config):
    """Pairs farthest from all asked so far, by their observations."""

    kind: Literal["k-center"] = "k-center"


class KCenterDisagreement(Config):
    """Of the better half by disagreement, the pairs farthest from all asked so far."""

    kind: Literal["k-center-disagreement"] = "k-center-disagreement"


class KCenterEntropy(Config):
    """Of the better half by entropy, the pairs farthest from all asked so far."""

    kind: Literal["k-center-entropy"] = "k-center-entropy"


class InstalledScheme(Config):
    """A scheme that an installed package offers."""

    kind: Literal["installed"] = "installed"
    name: str = Field("", description="What the package calls it.")


SchemeConfig = Annotated[
    Uniform | Disagreement | Entropy | KCenter | KCenterDisagreement | KCenterEntropy | InstalledScheme,
    Field(discriminator="kind"),
]
