"""What a checkpoint keeps of asking: how far it has come, and the pairs that are still to be posted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from trainer.episodes import EpisodePool
from trainer.posting import Asked
from trainer.query_selection import Chosen
from trainer.segments import SegmentData


@dataclass
class AskingState:
    """How far asking has come."""

    index: int = 0
    """Of the next session."""
    next_step: int = 0
    """Nothing is asked before it."""
    opened_step: int = 0
    """When the last session opened."""
    cursor: int = 0
    """The last answer learned from."""
    news_step: int = 0
    """When answers last came, of which the last was `news_sequence`."""
    news_sequence: int = 0
    told_shortage: bool = False
    """Whether the history says that nothing can be asked yet."""

    @classmethod
    def at_first(cls, step: int) -> AskingState:
        """Nothing has been asked, and nothing is before that step."""
        return cls(next_step=step, news_step=step)


def state_of(asked: Asked) -> dict[str, Any]:
    """Those pairs by the places of their segments, which the pool of a checkpoint holds too."""
    pairs = {
        index: {
            "segments": [[segment.episode.number, segment.start] for segment in chosen.pair],
            "scheme": chosen.scheme,
            "score": chosen.score,
        }
        for index, chosen in asked.pairs.items()
    }
    return {"session": asked.session.id, "pairs": pairs}


def pairs_from(rows: dict[int, Any], pool: EpisodePool, length: int) -> dict[int, Chosen] | None:
    """The saved pairs, their segments of that length; None when their episodes have left the pool."""
    episodes = {episode.number: episode for episode in pool.episodes}
    segments = [segment for row in rows.values() for segment in row["segments"]]
    if not {number for number, _ in segments} <= set(episodes):
        return None
    return {
        index: Chosen(
            tuple(SegmentData(episodes[n], start, length) for n, start in row["segments"]),  # type: ignore[arg-type]
            row["scheme"],
            row["score"],
        )
        for index, row in rows.items()
    }
