"""Segments: H steps of one episode, drawn in pairs that never overlap."""

from __future__ import annotations

import json
import statistics
from dataclasses import dataclass

import numpy as np
from safetensors.numpy import load as load_arrays
from safetensors.numpy import save as save_arrays

from trainer.episodes import Array, EpisodePool, FinishedEpisode


@dataclass(frozen=True)
class SegmentData:
    """H consecutive steps, cut from an episode of the pool."""

    episode: FinishedEpisode
    start: int
    length: int

    def _cut(self, column: Array) -> Array:
        return column[self.start : self.start + self.length]

    @property
    def states(self) -> Array:
        """Simulator states, [H, action_repeat, S]."""
        return self._cut(self.episode.states)

    @property
    def moments(self) -> Array:
        """The same one after the other, as they are drawn, [H · action_repeat, S]."""
        return one_by_one(self.states)

    @property
    def observations(self) -> Array:
        """[H, D]."""
        return self._cut(self.episode.observations)

    @property
    def true_return(self) -> float:
        """Undiscounted sum of the true reward."""
        return float(self._cut(self.episode.rewards).sum())

    @property
    def inputs(self) -> Array:
        """Observation and action joined, [H, D + A], as the reward model takes them."""
        return np.concatenate([self._cut(self.episode.observations), self._cut(self.episode.actions)], -1)

    def to_bytes(self) -> bytes:
        """The artifact: all that is needed to learn from the segment or to render it again."""
        columns = ("observations", "actions", "rewards", "states")
        arrays = {name: np.ascontiguousarray(self._cut(getattr(self.episode, name))) for name in columns}
        return bytes(save_arrays(arrays, metadata={"episode_seed": str(self.episode.seed)}))


def inputs_from_bytes(data: bytes) -> Array:
    """Observation and action joined, [H, D + A], of a stored segment."""
    arrays = load_arrays(data)
    return np.concatenate([arrays["observations"], arrays["actions"]], -1)


def states_from_bytes(data: bytes) -> tuple[int, Array]:
    """The episode's seed and simulator states [H · action_repeat, S] of a stored segment."""
    header = json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")])
    return int(header["__metadata__"]["episode_seed"]), one_by_one(load_arrays(data)["states"])


def one_by_one(states: Array) -> Array:
    """[H, n, S] → [H · n, S]; S may be 0."""
    steps, moments, size = states.shape
    return states.reshape(steps * moments, size)


def rewards_from_bytes(data: bytes) -> Array:
    """True rewards [H] of a stored segment."""
    return load_arrays(data)["rewards"]


Pair = tuple[SegmentData, SegmentData]


class PairSampler:
    """Draws pairs of disjoint segments: episodes uniform, starts uniform in [0, L − H]."""

    def __init__(self, pool: EpisodePool, length: int, rng: np.random.Generator) -> None:
        self.pool = pool
        self.length = length
        self.rng = rng

    def can_draw(self) -> bool:
        """Whether the pool holds two segments that do not overlap."""
        episodes = self.pool.at_least(self.length)
        return len(episodes) > 1 or any(len(episode) >= 2 * self.length for episode in episodes)

    def shortage(self) -> str:
        """Why nothing can be drawn, once some episodes are over; empty while that is too early to say."""
        lengths = sorted(map(len, self.pool.episodes))
        if self.can_draw() or len(lengths) < 2:
            return ""
        return (
            f"two segments of {self.length} steps cannot be cut from the last {len(lengths)} episodes, of which half"
            f" have at most {statistics.median_low(lengths)} steps and the longest has {lengths[-1]}"
        )

    def average_return(self, episodes: int = 10) -> float:
        """What H steps earned on average in the last episodes: R̄ · H / T (algorithm, section 7)."""
        latest = list(self.pool.episodes)[-episodes:]
        return self.length * sum(e.true_return for e in latest) / sum(map(len, latest))

    def draw(self, count: int) -> list[Pair]:
        """Pairs; ValueError where there is none to draw."""
        episodes = self.pool.at_least(self.length)
        if not self.can_draw():
            raise ValueError(f"no two disjoint segments of {self.length} steps in {len(episodes)} episodes")
        if len(episodes) == 1:
            return [self._pair_within(episodes[0]) for _ in range(count)]
        return [self._pair(episodes) for _ in range(count)]

    def _pair(self, episodes: list[FinishedEpisode]) -> Pair:
        """Drawn again until they are disjoint: of two episodes or more, soon."""
        while True:
            first, second = self._segment(episodes), self._segment(episodes)
            if first.episode is not second.episode or abs(first.start - second.start) >= self.length:
                return first, second

    def _pair_within(self, episode: FinishedEpisode) -> Pair:
        """Uniform over the disjoint pairs of one episode, however few there are."""
        places = len(episode) - 2 * self.length + 2
        one, other = self.rng.choice(places, 2, replace=False)
        starts = (one, other + self.length - 1) if one < other else (one + self.length - 1, other)
        first, second = (SegmentData(episode, int(start), self.length) for start in starts)
        return first, second

    def _segment(self, episodes: list[FinishedEpisode]) -> SegmentData:
        episode = episodes[self.rng.integers(len(episodes))]
        start = int(self.rng.integers(len(episode) - self.length + 1))
        return SegmentData(episode, start, self.length)
