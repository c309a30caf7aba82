"""How each task of Meta-world is put to people: a title, and what to look for in two clips."""

from __future__ import annotations

from types import MappingProxyType

# Task: (what is to be done, what the better clip shows).
_TASKS = {
    "assembly": (
        "put the ring on the peg",
        "the arm grips the ring by its handle and brings it over the red peg",
    ),
    "basketball": ("dunk the ball", "the arm grips the ball and drops it through the hoop"),
    "bin-picking": (
        "move the block between bins",
        "the arm lifts the block out of the red bin and into the blue one",
    ),
    "box-close": ("put the lid on the box", "the arm grips the lid by its handle and brings it onto the box"),
    "button-press": ("press the button", "the arm gets to the red button and pushes it farther in"),
    "button-press-topdown": (
        "press the button down",
        "the arm comes down on the red button and pushes it lower",
    ),
    "button-press-topdown-wall": (
        "press the button down, behind a wall",
        "the arm gets over the wall, comes down on the red button and pushes it lower",
    ),
    "button-press-wall": (
        "press the button, behind a wall",
        "the arm gets over the wall to the red button and pushes it farther in",
    ),
    "coffee-button": (
        "press the coffee machine's button",
        "the arm gets to the machine's button and pushes it in",
    ),
    "coffee-pull": ("pull the mug away", "the arm moves the mug from the machine to the green mark"),
    "coffee-push": ("push the mug in place", "the arm moves the mug under the machine, to the mark"),
    "dial-turn": ("turn the dial", "the arm gets to the dial and turns it farther round"),
    "disassemble": (
        "take the ring off the peg",
        "the arm grips the ring by its handle and lifts it off the red peg",
    ),
    "door-close": ("close the door", "the arm gets to the open door and pushes it farther shut"),
    "door-lock": ("lock the door", "the arm gets to the lock on the door and turns it down"),
    "door-open": ("open the door", "the arm gets to the door's handle and pulls the door farther open"),
    "door-unlock": ("unlock the door", "the arm gets to the lock on the door and turns it up"),
    "drawer-close": ("close the drawer", "the arm gets to the drawer and pushes it farther in"),
    "drawer-open": (
        "open the drawer",
        "the arm gets to the drawer's handle and pulls the drawer farther out",
    ),
    "faucet-close": (
        "close the faucet",
        "the arm gets to the red handle and turns it farther away from you",
    ),
    "faucet-open": ("open the faucet", "the arm gets to the red handle and turns it farther towards you"),
    "hammer": ("hammer the nail", "the arm grips the hammer and drives the nail farther into the box"),
    "hand-insert": (
        "put a hand in the hole",
        "the gripper moves the block aside and reaches down to the mark in the hole",
    ),
    "handle-press": ("press the handle", "the arm gets to the red handle and pushes it farther down"),
    "handle-press-side": (
        "press the handle at the side",
        "the arm gets to the red handle at the side and pushes it farther down",
    ),
    "handle-pull": ("pull the handle", "the arm gets under the red handle and pulls it farther up"),
    "handle-pull-side": (
        "pull the handle at the side",
        "the arm gets under the red handle at the side and pulls it farther up",
    ),
    "lever-pull": ("pull the lever", "the arm gets under the blue lever and pulls it farther up"),
    "peg-insert-side": (
        "put the peg in the hole",
        "the arm grips the green peg and brings it into the hole of the box",
    ),
    "peg-unplug-side": ("pull the plug", "the arm grips the plug and pulls it farther out of the box"),
    "pick-out-of-hole": (
        "pick out of the hole",
        "the arm grips the block in the hole and lifts it to the mark",
    ),
    "pick-place": ("pick and place", "the arm grips the block and carries it closer to the blue mark"),
    "pick-place-wall": (
        "pick and place over a wall",
        "the arm grips the block and carries it over the wall, closer to the blue mark",
    ),
    "plate-slide": ("slide the plate into the goal", "the arm pushes the black plate farther into the goal"),
    "plate-slide-back": (
        "slide the plate out of the goal",
        "the arm draws the black plate out of the goal, to the mark",
    ),
    "plate-slide-back-side": (
        "slide the plate out of the goal, sideways",
        "the arm draws the black plate sideways out of the goal, to the mark",
    ),
    "plate-slide-side": (
        "slide the plate into the goal, sideways",
        "the arm pushes the black plate sideways, farther into the goal",
    ),
    "push": ("push the block", "the arm gets to the block and pushes it closer to the green mark"),
    "push-back": (
        "push the block back",
        "the arm draws the block back towards itself, closer to the green mark",
    ),
    "push-wall": (
        "push the block past a wall",
        "the arm pushes the block around the wall, closer to the green mark",
    ),
    "reach": ("reach", "the gripper comes closer to the red mark and stays there"),
    "reach-wall": (
        "reach over a wall",
        "the gripper gets past the wall, closer to the red mark, and stays there",
    ),
    "shelf-place": (
        "put the block on the shelf",
        "the arm grips the blue block and brings it onto the shelf, to the mark",
    ),
    "soccer": ("kick the ball", "the arm pushes the ball farther into the goal"),
    "stick-pull": (
        "pull with a stick",
        "the arm grips the blue stick and pulls the bottle by it, closer to the green mark",
    ),
    "stick-push": (
        "push with a stick",
        "the arm grips the blue stick and pushes the bottle by it, closer to the green mark",
    ),
    "sweep": (
        "sweep the block away",
        "the arm gets to the block and sweeps it farther to the mark at the table's side",
    ),
    "sweep-into": (
        "sweep the block into the hole",
        "the arm gets to the block and sweeps it closer to the hole, or into it",
    ),
    "window-close": (
        "close the window",
        "the arm gets to the window's handle and slides the window farther shut",
    ),
    "window-open": (
        "open the window",
        "the arm gets to the window's handle and slides the window farther open",
    ),
}

META_WORLD_TITLES = MappingProxyType({task: f"Meta-world · {what}" for task, (what, _) in _TASKS.items()})
META_WORLD_GOALS = MappingProxyType(
    {task: f"Prefer the clip in which {shows}." for task, (_, shows) in _TASKS.items()}
)
