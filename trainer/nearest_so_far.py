"""The nearest states of each state in a buffer that grows: what was compared once is not compared again."""

from __future__ import annotations

import torch
from torch import Tensor

from trainer.neighbours import MEASURED, k_least, kth, nearest, squared_distances

MOST = 1 << 16
"""Pairs measured at a time, at most: 6 MB of differences between states of 24 numbers."""


class NearestSoFar:
    """For every state the k smallest squared distances to others, and with how many states it was compared.

    A state that is asked for again is compared with those that have come since. While B of N are drawn at every step
    these are about N / B, so that a step's cost grows with N, not with B · N. Exactly what a search of all finds.
    """

    def __init__(self, k: int) -> None:
        self._k = k
        self._squared = torch.empty(0, k)
        self._compared = torch.empty(0, dtype=torch.long)

    def distance(self, rows: Tensor, states: Tensor) -> Tensor:
        """L2 distance from the states in `rows` [B] to their k-th nearest of all states [N, D] but themselves: [B]."""
        self._make_room(len(states))
        different = torch.unique(rows)  # one that is drawn twice would count its new neighbours twice
        compared = self._compared[different]
        first = different[compared == 0]
        if len(first):
            self._squared[first] = nearest(states[first], first, states, self._k)
        behind = different[(compared > 0) & (compared < len(states))]
        if len(behind):
            longest_ago = len(states) - int(self._compared[behind].min())
            at_once = min(MEASURED, max(1, MOST // longest_ago))
            for some in torch.split(behind[self._compared[behind].argsort()], at_once):
                self._catch_up(some, states)
        self._compared[different] = len(states)
        return kth(self._squared[rows], len(states))

    def _catch_up(self, rows: Tensor, states: Tensor) -> None:
        """Compare with what has come since; the first of the rows was compared longest ago."""
        compared = self._compared[rows]
        since = int(compared[0])
        squared = squared_distances(states[rows], states[since:])
        squared.masked_fill_(torch.arange(since, len(states)) < compared[:, None], torch.nan)
        self._squared[rows] = k_least(torch.cat([self._squared[rows], squared], 1), self._k)

    def _make_room(self, count: int) -> None:
        missing = count - len(self._compared)
        if missing > 0:
            more = max(missing, len(self._compared))
            self._squared = torch.cat([self._squared, torch.empty(more, self._k)])
            self._compared = torch.cat([self._compared, torch.zeros(more, dtype=torch.long)])
