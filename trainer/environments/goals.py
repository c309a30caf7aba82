"""How each task of the suite is put to people: a title, and what to look for in two clips."""

from __future__ import annotations

from types import MappingProxyType

# Task: (title, what the better clip shows).
_TASKS = {
    "acrobot-swingup": (
        "Acrobot · swing up",
        "the two-link arm swings up and its tip stays close to the target above",
    ),
    "acrobot-swingup_sparse": (
        "Acrobot · swing up (sparse)",
        "the two-link arm gets its tip into the target above and keeps it there",
    ),
    "ball_in_cup-catch": (
        "Ball in cup · catch",
        "the ball ends up in the cup, or comes closest to falling into it, and stays there",
    ),
    "cartpole-balance": (
        "Cart pole · balance",
        "the pole stands upright, the cart stays near the middle and moves little",
    ),
    "cartpole-balance_sparse": (
        "Cart pole · balance (sparse)",
        "the pole stays upright for longer with the cart near the middle",
    ),
    "cartpole-swingup": (
        "Cart pole · swing up",
        "the pole swings up and then stands still above the cart, near the middle of the rail",
    ),
    "cartpole-swingup_sparse": (
        "Cart pole · swing up (sparse)",
        "the pole stands upright for longer with the cart near the middle of the rail",
    ),
    "cartpole-three_poles": (
        "Cart pole · three poles",
        "all three poles point up, slowly and in line, with the cart near the middle",
    ),
    "cartpole-two_poles": (
        "Cart pole · two poles",
        "both poles point up, slowly and in line, with the cart near the middle",
    ),
    "cheetah-run": ("Cheetah · run", "the cheetah runs to the right faster, on its feet"),
    "dog-fetch": ("Dog · fetch", "the dog stays upright, reaches the ball and brings it to the target"),
    "dog-run": ("Dog · run", "the dog runs forward faster, upright and on its paws"),
    "dog-stand": ("Dog · stand", "the dog stands tall on its four paws, body level and calm"),
    "dog-trot": ("Dog · trot", "the dog trots forward at a steady pace, upright and on its paws"),
    "dog-walk": ("Dog · walk", "the dog walks forward at a calm pace, upright and on its paws"),
    "finger-spin": ("Finger · spin", "the finger keeps the hinged body spinning faster"),
    "finger-turn_easy": (
        "Finger · turn (easy)",
        "the tip of the hinged body comes into the large target and stays there",
    ),
    "finger-turn_hard": (
        "Finger · turn (hard)",
        "the tip of the hinged body comes into the small target and stays there",
    ),
    "fish-swim": ("Fish · swim", "the fish swims straighter to the target and comes closer to it"),
    "fish-upright": ("Fish · upright", "the fish rights itself, back fin up, and stays level"),
    "hopper-hop": ("Hopper · hop", "the hopper hops to the right faster without falling"),
    "hopper-stand": ("Hopper · stand", "the hopper stands tall on its foot and stays there"),
    "humanoid-run": ("Humanoid · run", "the person runs faster, upright on two legs"),
    "humanoid-run_pure_state": (
        "Humanoid · run (pure state)",
        "the person runs faster, upright on two legs",
    ),
    "humanoid-stand": ("Humanoid · stand", "the person stands upright and still on two legs"),
    "humanoid-walk": ("Humanoid · walk", "the person walks at a calm pace, upright on two legs"),
    "humanoid_CMU-run": ("Humanoid CMU · run", "the person runs faster, upright on two legs"),
    "humanoid_CMU-stand": ("Humanoid CMU · stand", "the person stands upright and still on two legs"),
    "humanoid_CMU-walk": ("Humanoid CMU · walk", "the person walks at a calm pace, upright on two legs"),
    "lqr-lqr_2_1": (
        "Masses on springs · 2 masses, 1 motor",
        "both masses come to rest in line sooner, with gentle pushes",
    ),
    "lqr-lqr_6_2": (
        "Masses on springs · 6 masses, 2 motors",
        "all six masses come to rest in line sooner, with gentle pushes",
    ),
    "manipulator-bring_ball": (
        "Manipulator · bring the ball",
        "the arm grasps the ball and carries it closer to the target",
    ),
    "manipulator-bring_peg": (
        "Manipulator · bring the peg",
        "the arm grasps the peg and carries it closer to the target, turned the same way",
    ),
    "manipulator-insert_ball": (
        "Manipulator · insert the ball",
        "the arm grasps the ball and puts it into the cup",
    ),
    "manipulator-insert_peg": (
        "Manipulator · insert the peg",
        "the arm grasps the peg and puts it into the slot",
    ),
    "pendulum-swingup": ("Pendulum · swing up", "the pendulum swings up and stays pointing straight up"),
    "point_mass-easy": ("Point mass · easy", "the ball rolls straight to the target and stays in it"),
    "point_mass-hard": (
        "Point mass · hard",
        "the ball rolls straight to the target and stays in it, though its motors pull askew",
    ),
    "quadruped-escape": (
        "Quadruped · escape",
        "the robot stays upright and climbs farther out of the bowl",
    ),
    "quadruped-fetch": (
        "Quadruped · fetch",
        "the robot stays upright, reaches the ball and pushes it to the target in the middle",
    ),
    "quadruped-run": ("Quadruped · run", "the robot runs forward faster, upright on its four legs"),
    "quadruped-walk": (
        "Quadruped · walk",
        "the robot walks forward at a calm, steady pace, upright on its four legs",
    ),
    "reacher-easy": ("Reacher · easy", "the tip of the arm gets into the large target and stays there"),
    "reacher-hard": ("Reacher · hard", "the tip of the arm gets into the small target and stays there"),
    "stacker-stack_2": (
        "Stacker · two boxes",
        "the arm puts one box on the other where the target is, and lets go",
    ),
    "stacker-stack_4": (
        "Stacker · four boxes",
        "the arm stacks the boxes one on another where the target is, and lets go",
    ),
    "swimmer-swimmer15": (
        "Swimmer · 15 links",
        "the swimmer's nose moves straight to the target and stays close to it",
    ),
    "swimmer-swimmer6": (
        "Swimmer · 6 links",
        "the swimmer's nose moves straight to the target and stays close to it",
    ),
    "walker-run": ("Walker · run", "the walker runs to the right faster, upright on its two legs"),
    "walker-stand": ("Walker · stand", "the walker stands tall, upright and still"),
    "walker-walk": (
        "Walker · walk",
        "the walker walks to the right at a steady pace, upright, using both legs",
    ),
}

TITLES = MappingProxyType({task: title for task, (title, _) in _TASKS.items()})
GOALS = MappingProxyType({task: f"Prefer the clip in which {shows}." for task, (_, shows) in _TASKS.items()})

# Their episodes end when all masses have come to rest, which random actions do not bring about: control steps.
ENDING_EARLY = MappingProxyType({"lqr-lqr_2_1": 1000, "lqr-lqr_6_2": 1000})
