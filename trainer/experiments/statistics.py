"""Statistics of few runs: interquartile means with bootstrap intervals (Agarwal et al. 2021), paired differences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

Values = NDArray[np.float64]
RESAMPLES = 2000
FEWEST = 3
"""Runs of which an interval can be resampled: of one it has no width, of two it is just the two."""


def interquartile_mean(values: Values) -> Values:
    """The mean without the lowest and the highest quarter, over the last axis."""
    count = values.shape[-1]
    cut = count // 4
    ordered = np.sort(values, -1)
    mean: Values = ordered[..., cut : count - cut].mean(-1)
    return mean


def bootstrap_interval(values: Values, *, confidence: float = 0.95, seed: int = 0) -> tuple[Values, Values]:
    """Percentile interval of the interquartile mean under resampled runs, [..., n] → twice [...].

    It is not a number where there are too few to say anything.
    """
    if values.shape[-1] < FEWEST:
        unknown = np.full(values.shape[:-1], np.nan)
        return unknown, unknown
    rng = np.random.default_rng(seed)
    drawn = rng.integers(values.shape[-1], size=(RESAMPLES, values.shape[-1]))
    means = interquartile_mean(np.moveaxis(values[..., drawn], -2, 0))
    tail = 50 * (1 - confidence)
    low, high = np.percentile(means, [tail, 100 - tail], axis=0)
    return low, high


@dataclass(frozen=True)
class Difference:
    """By how much one method ends above another on the same seeds, with its 95 % interval."""

    mean: float
    low: float
    high: float
    seeds: Sequence[int]

    @property
    def verdict(self) -> str:
        """A claim counts as shown if the interval excludes zero."""
        if self.low > 0:
            return "higher"
        return "lower" if self.high < 0 else "undecided"


def paired_difference(one: Mapping[int, float], other: Mapping[int, float]) -> Difference:
    """Student's interval of the differences over the seeds that both have; ValueError with fewer than two."""
    seeds = sorted(one.keys() & other.keys())
    if len(seeds) < 2:
        raise ValueError(f"a paired difference needs two seeds that both methods have, not {len(seeds)}")
    differences = np.array([one[seed] - other[seed] for seed in seeds])
    mean, error = differences.mean(), differences.std(ddof=1) / np.sqrt(len(seeds))
    reach = student.ppf(0.975, len(seeds) - 1) * error
    return Difference(float(mean), float(mean - reach), float(mean + reach), seeds)
