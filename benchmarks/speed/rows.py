"""What is compared with what: each row a contest, in units that a reader knows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.speed.contest import ours, peer

INPUTS = 30


@dataclass(frozen=True)
class Row:
    """One contest. The first contestant is ours; `flops` are those of one unit's matrix products."""

    name: str
    unit: str
    contestants: Mapping[str, Sequence[str]]
    units: float = 1.0
    """How many of the named unit one unit of work is; the unit is a rate if it ends in /s, else a time."""
    flops: float = 0.0
    precision: str = "float32"
    threads: int = 2
    rounds: int = 3
    reach: str = ""
    """What is aimed at, in words."""


def sac_flops(width: int, batch: int) -> float:
    """Of one update: forward, gradients of weights and of inputs, only where they are needed."""
    critics = 2 * (INPUTS * width + width**2 + width)
    critics_through = 2 * (width**2 + width)
    actor, actor_through = 24 * width + width**2 + 12 * width, width**2 + 12 * width
    target, values = actor + critics, critics + critics + critics_through
    policy = actor + critics + critics_through + 2 * 6 * width + actor + actor_through
    return 2.0 * batch * (target + values + policy)


def model_flops(rows: int, *, learning: bool, width: int = 256, members: int = 3) -> float:
    """Of scoring rows by the reward model, or of learning from them."""
    forward = INPUTS * width + 2 * width**2 + width
    backward = forward + 2 * width**2 + width if learning else 0
    return 2.0 * rows * members * (forward + backward)


def product_rows() -> list[Row]:
    return [
        Row(
            "product of float32 matrices, 512 × 512, 1 thread",
            "/s",
            {
                "ours": ours("product", 1, size=512),
                "as PyTorch comes": ours("product", 1, size=512, plain=True),
            },
            flops=2 * 512**3,
            threads=1,
            reach="–",
        )
    ]


def sac_rows(peers: Path | None) -> list[Row]:
    small, large = "≥ 1.7× sbx, ≥ 2.5× sb3", "≥ 2.2× sbx, ≥ 70 % of limit"
    sizes = ((256, 2, small), (256, 1, small), (1024, 2, large))
    return [_sac_row(peers, width, threads, reach) for width, threads, reach in sizes]


def _sac_row(peers: Path | None, width: int, threads: int, reach: str) -> Row:
    """Two hidden layers and a batch of as many rows as they are wide."""
    contestants = {
        "ours": ours("sac", threads, width=width, batch=width, precision="bfloat16"),
        "ours float32": ours("sac", threads, width=width, batch=width),
        "autograd": ours("sac", threads, width=width, batch=width, plain=True),
    }
    theirs = {name: peer(peers, name, threads, width, width) for name in ("sb3", "sbx")} if peers else {}
    return Row(
        f"SAC update, 2×{width}, batch {width}, {_of(threads)}",
        "/s",
        {**contestants, **theirs},
        flops=sac_flops(width, width),
        precision="bfloat16",
        threads=threads,
        rounds=4,
        reach=reach,
    )


def neighbour_rows() -> list[Row]:
    return [
        Row(
            f"intrinsic reward, batch 1024 against 100k states, D {size}, 2 threads",
            "s",
            {"ours": ours("neighbours", 2, size=size), "slices": ours("sliced_neighbours", 2, size=size)},
            rounds=2,
            reach=f"≤ 0.3 s where slices take {slices} s",
        )
        for size, slices in ((24, 6.7), (78, 17))
    ] + [
        Row(
            "the same while exploring, at 10k states, D 24, 1 thread",
            "s",
            {
                "ours": ours("neighbours_so_far", 1, size=24),
                "search of all": ours("neighbours", 1, size=24, count=10_000),
            },
            threads=1,
            reach="–",
        )
    ]


def model_rows() -> list[Row]:
    """With two threads, as what is aimed at; with one, as runs have it."""
    return [*_model_rows(2, ("entropy", "disagreement")), *_model_rows(1, ("entropy",))]


def _model_rows(threads: int, schemes: Sequence[str]) -> list[Row]:
    fit, relabel, choose = (
        "≤ 36 s where autograd takes 102 s",
        "≤ 3 s where plain takes 12.5 s",
        "≤ 0.3 s where plain takes 3.6 s",
    )
    learned, scored = model_flops(700 * 100, learning=True), model_flops(200_000, learning=False)
    return [
        _model_row(
            "fit, 3 members, 700 labels × 50 steps × 2, 50 epochs",
            threads,
            fit,
            learned,
            1 / 50,
            "fit",
            labels=700,
        ),
        _model_row("relabel 1 M rows", threads, relabel, scored, 1 / 5, "relabel", rows=200_000),
        *(
            _model_row(
                f"select 140 of 1400 pairs by {scheme}",
                threads,
                choose,
                scored / 2,
                1.0,
                "choose",
                count=140,
                scheme=scheme,
            )
            for scheme in schemes
        ),
    ]


def _model_row(
    name: str, threads: int, reach: str, flops: float, units: float, task: str, **settings: int | str
) -> Row:
    contestants = {
        "ours": ours(task, threads, precision="bfloat16", **settings),
        "ours float32": ours(task, threads, **settings),
        "autograd": ours(task, threads, plain=True, **settings),
    }
    name, reach = f"{name}, {_of(threads)}", reach if threads == 2 else "–"  # aims are for two
    return Row(name, "s", contestants, units, flops, "bfloat16", threads, reach=reach)


def _of(threads: int) -> str:
    return f"{threads} thread{'s' * (threads > 1)}"


def clip_rows() -> list[Row]:
    return [
        Row(
            f"clip of 25 frames, 320×240, {task}, one core",
            "/s",
            {"ours": ours("clip", 1, scene=task), "defaults": ours("clip_by_defaults", 1, scene=task)},
            threads=1,
            reach=reach,
        )
        for task, reach in (("walker-walk", "≥ 3.5/s"), ("quadruped-walk", "≥ 2.5/s"))
    ]


def loop_rows() -> list[Row]:
    return [
        Row(
            f"whole loop, walker-walk, laptop profile, {phase}, {_of(threads)}",
            " steps/s",
            {
                "ours": ours("loop", threads, preset="walker-walk", exploring=exploring),
                "autograd": ours(
                    "loop",
                    threads,
                    preset="walker-walk",
                    exploring=exploring,
                    precision="float32",
                    plain=True,
                ),
            },
            threads=threads,
            reach=reach,
        )
        for phase, exploring, reach in (
            ("exploring", True, "≥ 4 × 45 steps/s, the public reference's"),
            ("training", False, "≥ 2.5 × 65 steps/s, the public reference's"),
        )
        for threads in (1, 2)
    ]


def all_rows(peers: Path | None) -> list[Row]:
    return [*product_rows(), *sac_rows(peers), *neighbour_rows(), *model_rows(), *clip_rows(), *loop_rows()]
