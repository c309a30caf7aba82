"""How many bytes a run will need, so that a disk is not found full in its middle."""

from __future__ import annotations

from dataclasses import dataclass

from labels_db.run_config import Asking, RunConfig

FLOAT = 4
DOUBLE = 8
CLIP_BYTES = 150_000
VIDEO_BYTES = 400_000
ROW_OVERHEAD = 2_000
"""Database bytes per query: its segments, leases, answers and scores."""


@dataclass(frozen=True)
class Estimate:
    """Bytes on disk at a run's largest, by what needs them."""

    checkpoints: int
    segments: int
    clips: int
    videos: int
    database: int

    @property
    def total(self) -> int:
        return self.checkpoints + self.segments + self.clips + self.videos + self.database


def estimate_bytes(config: RunConfig) -> Estimate:
    """An upper estimate; what a checkpoint shares with the one before is counted once."""
    known = config.catalogue_entry
    row = (known.observation_size + known.action_size + 2) * FLOAT
    rows = config.agent.transitions_kept(config)
    step = row + config.environment.action_repeat * known.state_size * DOUBLE
    segments = 2 * config.budget
    evaluations = config.total_steps // config.evaluation.every
    videos = {"each": evaluations, "last": 1, "none": 0}[config.evaluation.video]
    return Estimate(
        checkpoints=rows * row + 2 * rows * FLOAT + _pool_steps(config) * step + 2 * _network_bytes(config),
        segments=segments * config.segment_steps * step,
        clips=segments * CLIP_BYTES if config.asks_people else 0,
        videos=videos * VIDEO_BYTES,
        database=segments * ROW_OVERHEAD + config.total_steps * 2,
    )


def _pool_steps(config: RunConfig) -> int:
    if not isinstance(config.feedback, Asking):
        return 0
    episode_steps = config.catalogue_entry.episode_steps // config.environment.action_repeat
    return config.feedback.pool_episodes * episode_steps


def _network_bytes(config: RunConfig) -> int:
    """Five networks of the agent with two Adam moments each, at the widths configured."""
    agent, known = config.agent, config.catalogue_entry
    weights = (known.observation_size + known.action_size) * agent.width + agent.depth * agent.width**2
    return 5 * 3 * weights * FLOAT
