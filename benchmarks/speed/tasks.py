"""Units of work to be timed: each function prepares and returns what is done once per unit."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch

from benchmarks.speed.clip_tasks import clip, clip_by_defaults
from benchmarks.speed.model_tasks import choose, fit, relabel
from benchmarks.speed.work import ACTION, CPU, OBSERVATION, PRECISIONS, Work, as_pytorch_comes
from labels_db.run_config import SAC
from trainer.agents.sac import SACAgent
from trainer.agents.sac_autograd import AutogradUpdate
from trainer.collector import Transitions
from trainer.nearest_so_far import NearestSoFar
from trainer.neighbours import neighbour_distance
from trainer.randomness import Randomness


def peak(precision: str, size: int = 2048) -> Work:
    """One product of square matrices: 2·size³ floating-point operations."""
    left, right = (torch.randn(size, size, dtype=PRECISIONS[precision]) for _ in range(2))
    out = torch.empty_like(left)
    return lambda: torch.mm(left, right, out=out)


def product(size: int, plain: bool = False) -> Work:
    """One product of square float32 matrices."""
    if plain:
        as_pytorch_comes()
    return peak("float32", size)


def sac(width: int, batch: int, precision: str = "float32", plain: bool = False) -> Work:
    """One update of critics, actor and temperature; every second moves the targets."""
    agent = SACAgent(
        SAC(width=width, batch_size=batch),
        OBSERVATION,
        ACTION,
        20_000,
        Randomness(0),
        CPU,
        PRECISIONS[precision],
    )
    rng = np.random.default_rng(0)
    rows = [rng.normal(size=(5000, n)).astype(np.float32) for n in (OBSERVATION, ACTION, 1, OBSERVATION)]
    rewards, going_on = rows[2][:, 0], np.zeros(5000, bool)
    lived = Transitions(rows[0], np.tanh(rows[1]), rewards, rows[3], going_on, going_on, ())
    agent.buffer.remember(lived, torch.from_numpy(rewards))
    if plain:
        as_pytorch_comes()
        agent._update = AutogradUpdate(agent)
    return agent.update


# Neighbours --------------------------------------------------------------------------------------


def _states(count: int, size: int) -> torch.Tensor:
    """Correlated, off-centre states, as a robot's are."""
    generator = torch.Generator().manual_seed(0)
    mixing = 0.3 * torch.randn(size, size, generator=generator)
    return torch.randn(count, size, generator=generator) @ mixing + torch.randn(size, generator=generator)


def neighbours(size: int, count: int = 100_000, batch: int = 1024) -> Work:
    """The intrinsic reward's distances."""
    states = _states(count, size)
    rows = torch.randint(count, (batch,), generator=torch.Generator().manual_seed(1))
    return lambda: neighbour_distance(states[rows], rows, states, 5)


def neighbours_so_far(size: int, count: int = 10_000, batch: int = 1024) -> Work:
    """The same in a buffer that grows by one state a step, most of whose states have been drawn before."""
    states, generator = _states(2 * count, size), torch.Generator().manual_seed(1)
    known, lived = NearestSoFar(5), count
    known.distance(torch.arange(count), states[:count])

    def work() -> torch.Tensor:
        nonlocal lived
        lived += 1
        return known.distance(torch.randint(lived, (batch,), generator=generator), states[:lived])

    for _ in range(2 * count // batch):
        work()  # until what was compared last lies as far back as it does in a run
    return work


def sliced_neighbours(size: int, count: int = 100_000, batch: int = 1024) -> Work:
    """The same as it is usually done: every difference, in slices of the buffer, then one sort-like selection."""
    states = _states(count, size)
    rows = torch.randint(count, (batch,), generator=torch.Generator().manual_seed(1))

    def work() -> torch.Tensor:
        parts = [
            torch.norm(states[rows][:, None] - part[None], dim=-1, p=2) for part in torch.split(states, 500)
        ]
        return torch.kthvalue(torch.cat(parts, 1), k=6, dim=1).values

    return work


# The whole loop ----------------------------------------------------------------------------------


def loop(
    preset: str,
    exploring: bool,
    precision: str | None = None,
    plain: bool = False,
    profile: str | None = None,
) -> Work:
    """One step of training: environment, memory, update; while exploring also the intrinsic reward."""
    from benchmarks.speed.loop import Stepper

    return Stepper(preset, exploring=exploring, precision=precision, plain=plain, profile=profile)


TASKS: dict[str, Callable[..., Work]] = {
    task.__name__: task
    for task in (
        *(peak, product, sac, neighbours, neighbours_so_far, sliced_neighbours),
        *(fit, relabel, choose, clip, clip_by_defaults, loop),
    )
}
