"""Distances to the k-th nearest neighbour among many states: exact, and in products of matrices.

A plain search takes every difference of every pair of states. Here a product gives the squared distances but for a
constant, |y|² − 2x·y, with rounding; states are dealt into small groups, the groups whose least value may hold a
neighbour are measured exactly, and where rounding leaves a doubt about a row, that row is searched plainly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
import torch.nn.functional as F  # noqa: N812  (PyTorch's own convention)
from torch import Tensor

GROUP = 16
"""States in a group."""
STATES, QUERIES = 8192, 128
"""States compared at a time, at most, and with how many: their values, 4 MB, stay in a processor's cache."""
MEASURED = 64
"""Queries whose members are measured at a time: their differences stay in the cache, and on the heap."""
FEW = 1 << 14
"""Pairs up to which all are measured sooner than sieved."""
PAIRS = 1 << 24
"""Distances held at a time by the plain search: 64 MB."""
SAMPLE = 256
"""States of which the middle is taken."""
SPARE = 3
"""Groups measured beyond those that would do if nothing were rounded."""


def neighbour_distance(queries: Tensor, own: Tensor, states: Tensor, k: int) -> Tensor:
    """L2 distance from each query [B, D] to its k-th nearest among states [N, D] but itself: [B].

    `own` [B] is the row at which a query itself is among the states, −1 where it is not. With no more than k
    others the farthest stands in. On a GPU the plain search is fast enough, and waits for nothing.
    """
    if states.is_cuda:
        return plain_neighbour_distance(queries, own, states, k)
    return kth(nearest(queries, own, states, k), len(states))


def kth(squared: Tensor, among: int) -> Tensor:
    """The last of the k nearest [B, k], or of as many as there are among so many states: a distance, [B]."""
    return squared[:, max(1, min(squared.shape[1], among - 1)) - 1].sqrt()


def nearest(queries: Tensor, own: Tensor, states: Tensor, k: int) -> Tensor:
    """Squared distances to the k nearest, ascending, no numbers where there are fewer: [B, k].

    Each is measured by one formula, so that it is the same number whatever else is compared with it.
    """
    groups = k + 1 + SPARE
    if len(states) < 2 * GROUP * groups or len(queries) * len(states) <= FEW:
        return _nearest_of_all(queries, own, states, k)
    sieve = _sieve(queries, states, groups)
    found = _nearest_members(queries, own, states, sieve.members, k)
    doubtful = torch.nonzero(~(found[:, -1] <= sieve.beyond))[:, 0]  # so that nonsense is doubted too
    if len(doubtful):
        found[doubtful] = _nearest_of_all(queries[doubtful], own[doubtful], states, k)
    return found


def squared_distances(queries: Tensor, states: Tensor) -> Tensor:
    """From queries [B, D] to states, each query's [B, N, D] or the same for all [N, D]: [B, N]."""
    return (states - queries[:, None]).square_().sum(-1)


def _nearest_of_all(queries: Tensor, own: Tensor, states: Tensor, k: int) -> Tensor:
    """Every pair is measured."""
    at_once = max(1, FEW // len(states))
    parts = zip(torch.split(queries, at_once), torch.split(own, at_once), strict=True)
    every = torch.arange(len(states))
    return torch.cat(
        [
            k_least(squared_distances(few, states).masked_fill_(every == rows[:, None], torch.nan), k)
            for few, rows in parts
        ]
    )


def _nearest_members(queries: Tensor, own: Tensor, states: Tensor, members: Tensor, k: int) -> Tensor:
    """Of some members [B, n], for a few queries at a time."""
    parts = zip(*(torch.split(each, MEASURED) for each in (queries, own, members)), strict=True)
    return torch.cat([_of_members(few, rows, near, states, k) for few, rows, near in parts])


def _of_members(queries: Tensor, own: Tensor, members: Tensor, states: Tensor, k: int) -> Tensor:
    there = states.index_select(0, members.flatten().clamp(max=len(states) - 1))
    squared = squared_distances(queries, there.view(*members.shape, -1))
    return k_least(squared.masked_fill_((members == own[:, None]) | (members >= len(states)), torch.nan), k)


def k_least(values: Tensor, k: int) -> Tensor:
    """The k smallest of each row [B, n], ascending, no numbers where there are fewer: [B, k]."""
    found = values.topk(min(k, values.shape[1]), dim=1, largest=False).values
    return F.pad(found, (0, k - found.shape[1]), value=torch.nan)


def plain_neighbour_distance(queries: Tensor, own: Tensor, states: Tensor, k: int) -> Tensor:
    """The distance to the k-th by every difference of every pair: the reference."""
    k = max(1, min(k, len(states) - 1))
    parts = (torch.split(each, max(1, PAIRS // len(states))) for each in (queries, own))
    return torch.cat([_searched(few, rows, states, k) for few, rows in zip(*parts, strict=True)])


def _searched(queries: Tensor, own: Tensor, states: Tensor, k: int) -> Tensor:
    distance = torch.cdist(queries, states, compute_mode="donot_use_mm_for_euclid_dist")
    place = own.clamp(min=0)[:, None]
    distance.scatter_(1, place, distance.gather(1, place).masked_fill_(own[:, None] >= 0, torch.nan))
    return distance.topk(k, dim=1, largest=False).values[:, -1]


@dataclass(frozen=True)
class Sieve:
    """What may hold each query's neighbours."""

    members: Tensor
    """Rows of the states to be measured, [B, groups · GROUP]; beyond their end for want of states."""
    beyond: Tensor
    """No other state's squared distance is smaller than this, [B], whatever was rounded."""


def _sieve(queries: Tensor, states: Tensor, groups: int) -> Sieve:
    some = states[:: math.ceil(len(states) / SAMPLE)]
    centre = some.median(
        0
    ).values  # the smaller the numbers, the less is rounded; one far away moves no median
    x = queries - centre
    block = min(STATES, GROUP * math.ceil(len(states) / GROUP))
    # What is rounded is less than half of this times (|x| + |y|)², and so than this times |x|² + |y|².
    rounding = 4 * (x.shape[1] + 4) * torch.finfo(x.dtype).eps
    least = _least_of_groups(x, states, centre, block, rounding)
    least.masked_fill_(least.isnan(), -torch.inf)  # a state that is no number hides its group's others
    values, chosen = least.topk(groups + 1, dim=1, largest=False)
    return Sieve(_members(chosen[:, :-1], block), values[:, -1] + x.square().sum(1) * (1 - rounding))


def _least_of_groups(x: Tensor, states: Tensor, centre: Tensor, block: int, rounding: float) -> Tensor:
    """The least |y|² − 2x·y of each group, [B, groups], less what rounding y may have done to it.

    A group's states are `block / GROUP` apart. One more dimension adds |y|² within the product. The allowance is
    each state's own, so that one that is far away casts no doubt on the others.
    """
    blocks, per_block = math.ceil(len(states) / block), block // GROUP
    least = x.new_empty(len(x), blocks, per_block)
    some = torch.split(F.pad(-2 * x, (0, 1), value=1.0), QUERIES)
    values = x.new_empty(QUERIES, block)
    y = x.new_zeros(block, x.shape[1] + 1)
    for number, part in enumerate(torch.split(states, block)):
        torch.sub(part, centre, out=y[: len(part), :-1])
        torch.sum(y[: len(part), :-1].square(), 1, out=y[: len(part), -1]).mul_(1 - rounding)
        y[len(part) :, -1] = torch.inf  # what fills the last block is infinitely far
        for index, few in enumerate(some):
            found = torch.mm(few, y.t(), out=values[: len(few)]).view(len(few), GROUP, per_block)
            rows = slice(index * QUERIES, index * QUERIES + len(few))
            torch.amin(found, 1, out=least[rows, number])
    return least.flatten(1)


def _members(groups: Tensor, block: int) -> Tensor:
    """The states of each group, [B, n] → [B, n · GROUP]."""
    per_block = block // GROUP
    first = groups // per_block * block + groups % per_block
    apart = per_block * torch.arange(GROUP, device=groups.device)
    return (first[..., None] + apart).flatten(1)
