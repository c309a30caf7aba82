"""With how many threads a run computes on a CPU, and how they wait for each other; nothing here loads PyTorch."""

from __future__ import annotations

import os
from collections.abc import MutableMapping

from labels_db.run_config import RunConfig
from trainer.cores import available_cores

WIDE = 1024 * 512
"""Numbers in one layer of an update's batch from which a second thread gains though it sleeps between products."""

REST = 1.5
"""On two cores a training keeps four fifths of its rate then, and pairs still come faster than anybody answers them."""


def threads_of(config: RunConfig) -> int:
    """As configured; else one for each core where the agent's layers are wide, and one where they are not."""
    if config.threads is not None:
        return config.threads
    wide = config.agent.width * config.agent.batch_size >= WIDE
    return available_cores() if wide else 1


def rest_between_clips(config: RunConfig) -> float:
    """For how many seconds a run's drawing rests after each second of work.

    Drawing and threads on every core would take turns, and half of the training be lost while it lasts. One thread
    leaves a core to draw on; who says how many threads a run has is to be kept waiting for nothing.
    """
    return REST if config.threads is None and threads_of(config) > 1 else 0.0


def wait_asleep(config: RunConfig, environment: MutableMapping[str, str] = os.environ) -> None:
    """Have threads whose number nobody chose sleep until there is work: to be called before PyTorch is loaded.

    OpenMP's threads spin by default. Faster alone, they take the cores from whoever does work: two runs of two threads
    each on two cores were a quarter as fast as with one thread each (docs/performance.md). Asleep they share.
    Whoever says how many threads a run has knows what else runs, and keeps OpenMP's own way.
    """
    if config.threads is None:
        environment.setdefault("OMP_WAIT_POLICY", "passive")
