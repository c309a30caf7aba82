"""Behaviours: a person's wish, put as a reward over the simulator, for scripted teachers."""

from __future__ import annotations

from trainer.environments.behaviours.start import Start, as_the_task_starts
from trainer.environments.behaviours.table import BEHAVIOURS, BehaviourSpec
from trainer.environments.behaviours.wish import Measures, Memory, Wish

__all__ = ["BEHAVIOURS", "BehaviourSpec", "Measures", "Memory", "Start", "Wish", "as_the_task_starts"]
