"""Figures that are tables, in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from labels_db.figures import Differences, Ends
from trainer.experiments.drawing import Drawing
from trainer.experiments.panels import NothingToShowError
from trainer.experiments.results import Results
from trainer.experiments.statistics import bootstrap_interval, interquartile_mean, paired_difference


def ends(figure: Ends, drawing: Drawing) -> Path:
    """Task by method: the finished seeds' last values and their interquartile mean."""
    results, rows = drawing.results, []
    for task in drawing.tasks(figure.tasks):
        for method in drawing.methods(figure.methods):
            last = results.last(task, method, figure.measure)
            if last:
                lived = [f"{results.steps(task, method):,}", f"{results.answers(task, method):.0f}"]
                rows.append([task, method, *lived, *_ends(last), _share(last, figure.published.get(task))])
    if not rows:
        raise NothingToShowError(f"no finished run has the measure {figure.measure!r} yet")
    head = ["task", "method", "steps", "answers", "seeds", "IQM", "95 % interval", "of published"]
    shown = len(head) if figure.published else len(head) - 1
    return _written(drawing.path(figure), head[:shown], (row[:shown] for row in rows))


def _ends(last: Mapping[int, float]) -> list[str]:
    """Every seed's, their interquartile mean and its interval, if they are enough for one."""
    values = np.array(list(last.values()))
    low, high = bootstrap_interval(values)
    digits = _digits(values)
    seeds = ", ".join(f"{value:.{digits}f}" for value in values)
    interval = "–" if np.isnan(low) else f"{low:.{digits}f} … {high:.{digits}f}"
    return [seeds, f"{interquartile_mean(values):.{digits}f}", interval]


def _digits(values: Iterable[float]) -> int:
    """Behind the point: returns are in the hundreds, success and alternation within one."""
    return 1 if max(map(abs, values)) >= 10 else 2


def _share(last: Mapping[int, float], published: float | None) -> str:
    if published is None:
        return ""
    return f"{interquartile_mean(np.array(list(last.values()))) / published:.1%} of {published:g}"


def differences(figure: Differences, drawing: Drawing) -> Path:
    """Task by pair that meets there, with interval and verdict."""
    head = ["task", "pair", "steps", "answers", "seeds", "difference", "95 % interval", "verdict", "share"]
    rows = [
        [
            *(task, _pair(one, other, figure.share)),
            *_lived(task, (one, other), drawing.results),
            *_difference(task, one, other, figure, drawing),
        ]
        for task in drawing.experiment.tasks
        for one, other in figure.pairs
        if {one, other} <= drawing.compared_on(task)
    ]
    return _written(drawing.path(figure), head, rows)


def _pair(one: str, other: str, share: float) -> str:
    return f"{one} − {other}" if share == 1 else f"{one} − {share:g} · {other}"


def _lived(task: str, pair: tuple[str, str], results: Results) -> list[str]:
    """Steps and answers of the one and of the other."""
    steps = [f"{results.steps(task, method):,}" for method in pair]
    answers = [f"{results.answers(task, method):.0f}" for method in pair]
    return [" / ".join(steps), " / ".join(answers)]


def _difference(task: str, one: str, other: str, figure: Differences, drawing: Drawing) -> list[str]:
    ends = [drawing.results.last(task, method, figure.measure) for method in (one, other)]
    try:
        found = paired_difference(ends[0], {seed: figure.share * end for seed, end in ends[1].items()})
    except ValueError as error:
        return ["", "–", "–", str(error), "–"]
    digits = _digits([end for each in ends for end in each.values()])
    interval = f"{found.low:+.{digits}f} … {found.high:+.{digits}f}"
    mine, theirs = (np.mean([each[seed] for seed in found.seeds]) for each in ends)
    share = f"{mine / theirs:.0%}" if theirs > 0 else ""
    return [str(len(found.seeds)), f"{found.mean:+.{digits}f}", interval, found.verdict, share]


def _written(path: Path, head: Sequence[str], rows: Iterable[Sequence[str]]) -> Path:
    lines = [head, ["---"] * len(head), *rows]
    path.write_text("".join(f"| {' | '.join(line)} |\n" for line in lines), encoding="utf-8")
    return path
