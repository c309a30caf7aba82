"""Pictures of what runs do and ask, drawn anew from simulator states: no run needs to have kept a video."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from sqlalchemy import select

from labels_db.catalogue import EnvironmentUnavailableError
from labels_db.data_folder import DataFolder
from labels_db.models import FeedbackSession, Query, Segment
from labels_db.run_config import Clips, RunConfig
from labels_db.runs import config_of, get_run
from trainer.environments import Environment, make_environment
from trainer.evaluation import EvaluatedEpisode, evaluate
from trainer.experiments.panels import NothingToShowError
from trainer.policy import load_policy
from trainer.rendering import CLIP_SECONDS, EncodedClip, Renderer, drawn
from trainer.segments import states_from_bytes

SECONDS = 2.0
"""How much of an episode a strip shows."""
ASKED_FRAMES = 4
CLIPS = Clips(width=240, height=180)

Picture = NDArray[np.uint8]


@dataclass(frozen=True)
class Row:
    """A run to show, and the measure that says which of its episodes is best."""

    title: str
    run_id: str
    best_by: str


def strips(rows: list[Row], data: DataFolder, frames: int, path: Path) -> Path:
    """A row of frames each: the middle seconds of the best of five episodes."""
    return _stacked([(row.title, _strip(row, data, frames)) for row in rows], path)


def _strip(row: Row, data: DataFolder, frames: int) -> Picture:
    with data.open_database() as database:
        with database.read() as session:
            config = config_of(get_run(session, row.run_id))
        environment = _environment(config)  # first: a policy cannot be taken without its environment's sizes
        policy = load_policy(database, data.open_store(), row.run_id)
    lived = evaluate(policy, environment, seed=config.seed, episodes=5)
    best = max(lived, key=lambda episode: _came_to(episode, row.best_by))
    middle = _middle(best, round(SECONDS / environment.control_step))
    return _frames(_drawn(config, [middle])[0], frames)


def _environment(config: RunConfig) -> Environment:
    """Where a run lived; NothingToShowError where the catalogue has lost it, or its package is not there any more."""
    if not config.environment.is_known:
        raise NothingToShowError(*config.caveats)
    try:
        return make_environment(config.environment)
    except EnvironmentUnavailableError as error:
        raise NothingToShowError(f"its environment cannot be made here any more: {error}") from error


def _came_to(episode: EvaluatedEpisode, measure: str) -> float:
    return {**episode.measures, "return": episode.true_return}[measure]


def _middle(episode: EvaluatedEpisode, steps: int) -> tuple[int, Any]:
    """Seed and states [steps, S] of an episode's middle."""
    start = max(0, len(episode.states) // 2 - steps // 2)
    return episode.seed, episode.states[start : start + steps]


def query_sheet(
    runs: list[tuple[str, str]], data: DataFolder, sessions: list[int], count: int, path: Path
) -> Path:
    """(title, run) → a row for each of the first `count` queries of some sessions, both segments side by side."""
    rows = [row for title, run_id in runs for row in _asked(title, run_id, data, sessions, count)]
    return _stacked(rows, path)


def _asked(
    title: str, run_id: str, data: DataFolder, sessions: list[int], count: int
) -> list[tuple[str, Picture]]:
    store = data.open_store()
    with data.open_database() as database, database.read() as session:
        config = config_of(get_run(session, run_id))
        _environment(config)  # the rendering process could only say that it cannot draw
        asked = session.execute(
            select(FeedbackSession.index, Query)
            .join(Query, Query.session_id == FeedbackSession.id)
            .where(Query.run_id == run_id, FeedbackSession.index.in_(sessions), Query.index < count)
            .order_by(FeedbackSession.index, Query.index)
        ).all()
        pairs = [(index, query.index, query.first, query.second) for index, query in asked]
    states = [states_from_bytes(store.read(s.artifact_key, s.checksum)) for *_, a, b in pairs for s in (a, b)]
    clips = [_frames(clip, ASKED_FRAMES) for clip in _drawn(config, states)]
    return [
        (
            f"{title}, session {index}, query {number}: {_returns(first, second)}",
            _beside(*clips[2 * row :][:2]),
        )
        for row, (index, number, first, second) in enumerate(pairs)
    ]


def _returns(first: Segment, second: Segment) -> str:
    return " | ".join(
        "–" if s.true_return is None else f"true return {s.true_return:.1f}" for s in (first, second)
    )


def _drawn(config: RunConfig, segments: list[tuple[int, Any]]) -> list[EncodedClip]:
    """Clips of which only frames are shown, so that it does not matter how long each is."""
    with Renderer(config.environment, CLIPS) as renderer:
        asked = [renderer.clip(seed, states, config.step_seconds) for seed, states in segments]
        return [drawn(clip, CLIP_SECONDS) for clip in asked]


def _frames(clip: EncodedClip, count: int) -> Picture:
    """Evenly spaced frames of a sprite sheet, side by side: [height, count · width, 3]."""
    sheet = np.asarray(Image.open(io.BytesIO(clip.data)).convert("RGB"))
    chosen = np.linspace(0, clip.frames - 1, count).round().astype(int)
    places = [divmod(int(index), clip.columns) for index in chosen]
    height, width = clip.height, clip.width
    return np.hstack([sheet[r * height : (r + 1) * height, c * width : (c + 1) * width] for r, c in places])


def _beside(first: Picture, second: Picture) -> Picture:
    gap = np.full((first.shape[0], 24, 3), 255, np.uint8)
    return np.hstack([first, gap, second])


def _stacked(rows: list[tuple[str, Picture]], path: Path) -> Path:
    """Every picture under its title."""
    from matplotlib import pyplot

    if not rows:
        raise NothingToShowError("no run here has anything to show yet")
    aspect = rows[0][1].shape[0] / rows[0][1].shape[1]
    size = (11, len(rows) * (11 * aspect + 0.35))
    figure, grid = pyplot.subplots(len(rows), 1, figsize=size, squeeze=False, layout="constrained")
    for axes, (title, picture) in zip(grid.flat, rows, strict=True):
        axes.imshow(picture)
        axes.set_title(title, fontsize=9, loc="left")
        axes.axis("off")
    figure.savefig(path, dpi=110)
    pyplot.close(figure)
    return path
