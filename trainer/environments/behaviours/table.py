"""The behaviours there are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType

from trainer.environments.behaviours.hopper import Backflip
from trainer.environments.behaviours.quadruped import Wave
from trainer.environments.behaviours.start import Start, as_the_task_starts, crouching, on_four_feet
from trainer.environments.behaviours.walker import BothLegs
from trainer.environments.behaviours.windmill import Windmill
from trainer.environments.behaviours.wish import Wish


@dataclass(frozen=True)
class BehaviourSpec:
    """A wish over one task's simulator and start, and how it is put to people."""

    title: str
    goal: str
    task: str
    make_wish: Callable[[], Wish]
    start: Start = as_the_task_starts


BEHAVIOURS = MappingProxyType(
    {
        "cartpole-windmill-clockwise": BehaviourSpec(
            title="Cart pole · clockwise windmill",
            goal="Prefer the clip in which the pole turns clockwise, faster and more evenly.",
            task="cartpole-swingup",
            make_wish=partial(Windmill, sign=1),
        ),
        "cartpole-windmill-counter-clockwise": BehaviourSpec(
            title="Cart pole · counter-clockwise windmill",
            goal="Prefer the clip in which the pole turns counter-clockwise, faster and more evenly.",
            task="cartpole-swingup",
            make_wish=partial(Windmill, sign=-1),
        ),
        "hopper-backflip": BehaviourSpec(
            title="Hopper · backflip",
            goal="Prefer the clip in which the hopper turns over backward, away from its nose, higher and faster.",
            task="hopper-hop",
            make_wish=Backflip,
            start=crouching,
        ),
        "quadruped-wave-left-front": BehaviourSpec(
            title="Quadruped · wave the left front leg",
            goal="Prefer the clip in which the robot stands on three legs and waves its left front leg up and down.",
            task="quadruped-walk",
            make_wish=partial(Wave, leg="front_left"),
            start=on_four_feet,
        ),
        "quadruped-wave-right-front": BehaviourSpec(
            title="Quadruped · wave the right front leg",
            goal="Prefer the clip in which the robot stands on three legs and waves its right front leg up and down.",
            task="quadruped-walk",
            make_wish=partial(Wave, leg="front_right"),
            start=on_four_feet,
        ),
        "walker-walk-both-legs": BehaviourSpec(
            title="Walker · walk with both legs",
            goal="Prefer the clip in which the walker walks to the right, upright, its two legs taking turns in front.",
            task="walker-walk",
            make_wish=BothLegs,
        ),
    }
)
