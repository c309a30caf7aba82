"""Where the camera stands: one framing per domain, or per task where that differs."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True)
class Framing:
    """A camera on a sphere around a point: metres and degrees.

    Azimuth 90 looks along +y, so that x runs to the right; elevation −90 looks straight down.
    The point moves with the centre of mass of the body `follows` along `axes`, by `share` of its way:
    so the camera stays level while the robot jumps or falls.
    """

    centre: tuple[float, float, float]
    distance: float
    azimuth: float = 90.0
    elevation: float = -8.0
    follows: str | None = None
    axes: str = "xy"
    share: float = 1.0


FIELD_OF_VIEW = 30.0  # degrees, vertical: narrow enough to keep limbs near the border in proportion

FRAMINGS = MappingProxyType(
    {
        "Ant": Framing((0, 0, 0.5), 5.0, azimuth=120, elevation=-20, follows="torso"),
        "HalfCheetah": Framing((0, 0, 0.55), 3.5, follows="torso", axes="x"),
        "Hopper": Framing((0, 0, 0.75), 3.9, follows="torso", axes="x"),
        "Humanoid": Framing((0, 0, 0.85), 4.4, azimuth=120, elevation=-10, follows="torso"),
        "HumanoidStandup": Framing((0, 0, 0.55), 4.2, azimuth=120, elevation=-15, follows="torso"),
        "InvertedDoublePendulum": Framing((0, 0, 0.4), 4.8, elevation=-5),
        "InvertedPendulum": Framing((0, 0, 0.2), 3.2, elevation=-5),
        "Pusher": Framing((0.3, -0.25, -0.2), 2.8, azimuth=120, elevation=-40),
        "Reacher": Framing((0, 0, 0), 1.0, elevation=-80),
        "Swimmer": Framing((0, 0, 0), 5.2, elevation=-50, follows="torso"),
        "Walker2d": Framing((0, 0, 0.8), 4.3, follows="torso", axes="x"),
        "acrobot": Framing((0, 0, 2.05), 8.8),
        "ball_in_cup": Framing((0, 0, 0.36), 1.6),
        # Following by a share keeps the whole swing in view at both ends of the rail, and the pole large.
        "cartpole": Framing((0, 0, 1), 6.0, elevation=-5, follows="cart", axes="x", share=0.5),
        "cartpole-two_poles": Framing((0, 0, 1), 8.8, elevation=-5, follows="cart", axes="x", share=0.5),
        "cartpole-three_poles": Framing((0, 0, 1), 12.4, elevation=-5, follows="cart", axes="x", share=0.5),
        "cheetah": Framing((0, 0, 0.55), 3.5, follows="torso", axes="x"),
        "dog": Framing((0, 0, 0.4), 2.7, azimuth=60, elevation=-14, follows="torso"),
        "finger": Framing((0, 0, 0.38), 1.6),
        "fish": Framing((0, 0, 0), 0.8, elevation=-30, follows="torso", axes="xyz"),
        "fish-swim": Framing((0, 0, 0), 1.25, elevation=-35, follows="torso", axes="xyz"),
        "hopper": Framing((0, 0, 0.75), 3.5, follows="torso", axes="x"),
        "humanoid": Framing((0, 0, 0.85), 3.9, azimuth=120, elevation=-10, follows="torso"),
        "humanoid_CMU": Framing((0, 0, 0.85), 3.9, azimuth=120, elevation=-10, follows="root"),
        "lqr": Framing((0.9, 0, 0.1), 4.4, elevation=-40),
        "manipulator": Framing((0, 0, 0.41), 1.75, elevation=-3),
        "metaworld": Framing((0, 0.65, 0.14), 1.75, azimuth=145, elevation=-32),
        "pendulum": Framing((0, 0, 0.6), 2.45),
        "point_mass": Framing((0, 0, 0), 1.2, elevation=-70),
        "quadruped": Framing((0, 0, 0.4), 4.5, azimuth=120, elevation=-18, follows="torso"),
        "quadruped-escape": Framing((0, 0, 0), 5.0, azimuth=120, elevation=-25, follows="torso", axes="xyz"),
        "reacher": Framing((0, 0, 0), 1.2, elevation=-80),
        "stacker": Framing((0, 0, 0.41), 1.75, elevation=-3),
        "swimmer": Framing((0, 0, 0), 2.0, elevation=-50, follows="head"),
        "swimmer-swimmer15": Framing((0, 0, 0), 2.7, elevation=-50, follows="head"),
        "walker": Framing((0, 0, 0.9), 4.1, follows="torso", axes="x"),
    }
)


def framing(name: str) -> Framing | None:
    """The framing of a task named as in `walker-walk`; None where the model's own extent must do."""
    return FRAMINGS.get(name, FRAMINGS.get(name.partition("-")[0]))
