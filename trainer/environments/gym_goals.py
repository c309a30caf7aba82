"""How Gymnasium's environments are put to people: a title, what to look for in two clips, how episodes end."""

from __future__ import annotations

from types import MappingProxyType
from typing import NamedTuple


class GymGoal(NamedTuple):
    """A title, what the better clip shows, and where episodes can end early how many control steps they last.

    That is the median of episodes with random actions.
    """

    title: str
    shows: str
    random_steps: int = 0

    @property
    def goal(self) -> str:
        return f"Prefer the clip in which {self.shows}."


GYM_GOALS = MappingProxyType(
    {
        "Ant-v5": GymGoal(
            "Gym Ant · run", "the ant runs to the right faster, upright on its four legs", random_steps=78
        ),
        "BipedalWalker-v3": GymGoal(
            "Gym Bipedal walker · walk",
            "the walker gets farther to the right over the rough ground without falling",
            random_steps=105,
        ),
        "HalfCheetah-v5": GymGoal(
            "Gym Half cheetah · run", "the cheetah runs to the right faster, on its feet"
        ),
        "Hopper-v5": GymGoal(
            "Gym Hopper · hop", "the hopper hops to the right faster without falling", random_steps=20
        ),
        "Humanoid-v5": GymGoal(
            "Gym Humanoid · walk",
            "the person walks to the right faster, upright on two legs",
            random_steps=22,
        ),
        "HumanoidStandup-v5": GymGoal(
            "Gym Humanoid · stand up", "the person gets up from lying, with the head higher"
        ),
        "InvertedDoublePendulum-v5": GymGoal(
            "Gym Double pendulum · balance",
            "the two poles stay upright on the cart for longer",
            random_steps=6,
        ),
        "InvertedPendulum-v5": GymGoal(
            "Gym Pendulum on a cart · balance",
            "the pole stays upright on the cart for longer",
            random_steps=5,
        ),
        "LunarLanderContinuous-v3": GymGoal(
            "Gym Lunar lander · land",
            "the lander comes down more gently and upright, closer to the place between the flags",
            random_steps=103,
        ),
        "MountainCarContinuous-v0": GymGoal(
            "Gym Mountain car · climb",
            "the car swings higher up the right hill, or reaches the flag with less effort",
            random_steps=999,
        ),
        "Pendulum-v1": GymGoal(
            "Gym Pendulum · swing up", "the pendulum swings up and then stays pointing straight up"
        ),
        "Pusher-v5": GymGoal(
            "Gym Pusher · push", "the arm pushes the white cylinder closer to the red target"
        ),
        "Reacher-v5": GymGoal(
            "Gym Reacher · reach", "the tip of the arm comes closer to the target and stays there"
        ),
        "Swimmer-v5": GymGoal("Gym Swimmer · swim", "the swimmer moves to the right faster"),
        "Walker2d-v5": GymGoal(
            "Gym Walker · walk", "the walker walks to the right faster, upright on two legs", random_steps=20
        ),
    }
)
