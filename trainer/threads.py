"""With how many threads a run computes on a CPU, and how they wait for each other; nothing here loads PyTorch."""

from __future__ import annotations

import os
from collections.abc import MutableMapping

from labels_db.run_config import RunConfig
from trainer.cores import available_cores

WIDE = 1024 * 512
"""Numbers in one layer of an update's batch from which a second thread gains though it sleeps between products."""


def threads_of(config: RunConfig) -> int:
    """As configured; else one for each core where the agent's layers are wide, and one where they are not."""
    if config.threads is not None:
        return config.threads
    wide = config.agent.width * config.agent.batch_size >= WIDE
    return available_cores() if wide else 1


def wait_asleep(config: RunConfig, environment: MutableMapping[str, str] = os.environ) -> None:
    """Have threads whose number nobody chose sleep until there is work: to be called before PyTorch is loaded.

    OpenMP's threads spin by default. Faster alone, they take the cores from whoever does work: two runs of two threads
    each on two cores were a quarter as fast as with one thread each (docs/performance.md). Asleep they share.
    Whoever says how many threads a run has knows what else runs, and keeps OpenMP's own way.
    """
    if config.threads is None:
        environment.setdefault("OMP_WAIT_POLICY", "passive")
