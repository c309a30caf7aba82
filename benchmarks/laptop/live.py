"""One run of the sweep: `python -m benchmarks.laptop.live TASK VARIATION SEED FILE`.

The budget is processor time of this process, one thread, so that what else runs beside it costs it nothing;
evaluations are not counted.
"""

from __future__ import annotations

import contextlib
import json
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import torch

from benchmarks.laptop.variations import settings
from labels_db.overrides import with_settings
from labels_db.presets import preset_named
from labels_db.run_config import RunConfig
from trainer.agents.interface import Losses
from trainer.assembly import assemble
from trainer.collector import Transitions
from trainer.environments import make_environment
from trainer.evaluation import evaluate
from trainer.feedback import RecordedFits
from trainer.journal import SilentJournal
from trainer.training import NoUpkeep, Training

BUDGET_S = 600.0
EVERY_S = 60.0
EPISODES = 10


class TimeIsUp(Exception):  # noqa: N818  (it is no error)
    """The budget is spent."""


@dataclass
class Stopwatch(NoUpkeep):
    """Upkeep that evaluates every minute of processor time and ends the run after ten."""

    config: RunConfig
    began: float = field(default_factory=time.process_time)
    curve: list[dict[str, Any]] = field(default_factory=list)

    def after_step(self, training: Training, transitions: Transitions, losses: Losses | None) -> None:
        spent = time.process_time() - self.began
        if spent < EVERY_S * (len(self.curve) + 1):
            return
        returns = self._returns(training)
        self.curve.append({"seconds": round(spent, 1), "step": training.step, "returns": returns})
        if spent >= BUDGET_S:
            raise TimeIsUp
        self.began = time.process_time() - spent

    def _returns(self, training: Training) -> list[float]:
        environment = make_environment(self.config.environment)
        episodes = evaluate(
            lambda observations: training.agent.act(observations, explore=False),
            environment,
            seed=self.config.seed,
            episodes=EPISODES,
        )
        return [round(episode.true_return, 2) for episode in episodes]


def live(task: str, variation: str, seed: int) -> dict[str, Any]:
    """The run's settings and its curve over processor time."""
    chosen = settings(task, variation)
    config = with_settings(preset_named(task).config(), {**chosen, "seed": str(seed)})
    watch = Stopwatch(config)
    training = assemble(
        config,
        feedback=RecordedFits([]),
        answered=None,
        journal=SilentJournal(),
        upkeep=watch,
        device=torch.device("cpu"),
    )
    with contextlib.suppress(TimeIsUp):
        training.train()
    return {"task": task, "variation": variation, "seed": seed, "settings": chosen, "curve": watch.curve}


def main() -> None:
    task, variation, seed, file = sys.argv[1:]
    result = live(task, variation, int(seed))
    partial = Path(f"{file}.part")
    partial.write_text(json.dumps(result) + "\n", encoding="utf-8")
    partial.replace(file)


if __name__ == "__main__":
    main()
