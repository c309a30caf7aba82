"""Scripted teachers, who stand in for people: from true rewards to a choice (B-Pref, Lee et al. 2021)."""

from __future__ import annotations

import math
import uuid
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from labels_db.answers import answer_query, pressed_for
from labels_db.leases import labeller_named, lend
from labels_db.models import Choice, LabellerKind, Query, Segment, utc_now
from labels_db.run_config import (
    Equal,
    InstalledTeacher,
    Mistaken,
    Myopic,
    Oracle,
    Scripted,
    Skipping,
    Stochastic,
)
from labels_db.storage import ArtifactStore
from trainer import extensions
from trainer.extensions import installed
from trainer.randomness import derived_seed
from trainer.segments import rewards_from_bytes

Two = tuple[float, float]
"""Something of σ⁰ and σ¹."""


def judge(config: Scripted, returns: Two, felt: Two, average: float, rng: np.random.Generator) -> Choice:
    """The choice between two segments (algorithm, section 7).

    `returns` are their undiscounted true returns, `felt` what a forgetful teacher feels of them, `average` is
    what a segment of that length earned in the last episodes.
    """
    if config.skip and max(returns) <= config.skip * average:
        return Choice.SKIP
    if config.equal and abs(returns[0] - returns[1]) < config.equal * average:
        return Choice.EQUAL
    if config.tie == "equal" and returns[0] == returns[1]:
        return Choice.EQUAL
    mistaken = rng.random() < config.mistake
    return Choice.SECOND if _prefers_second(config, felt, rng) != mistaken else Choice.FIRST


def _prefers_second(config: Scripted, felt: Two, rng: np.random.Generator) -> bool:
    if config.rationality is None:
        return felt[1] > felt[0]
    log_odds = config.rationality * (felt[1] - felt[0])
    return rng.random() < 0.5 * (1 + math.tanh(log_odds / 2))  # the logistic function, without overflow


Judge = Callable[[Any, Two, Two, float, np.random.Generator], Choice]
"""As `judge`."""


def judge_of(config: Scripted) -> Judge:
    """Who judges; ValueError where no installed package offers it."""
    if isinstance(config, InstalledTeacher):
        found: Judge = installed(extensions.TEACHERS, config.name)
        return found
    return judge


class ScriptedTeacher:
    """Judges the queries of one run from its record; chance belongs to the query, not to the moment."""

    def __init__(self, config: Scripted, store: ArtifactStore, seed: int) -> None:
        self.config = config
        self.judge = judge_of(config)
        self.store = store
        self.seed = seed

    def __call__(self, query: Query) -> Choice:
        asked = query.session
        rng = np.random.default_rng(derived_seed(self.seed, "teacher", asked.index, query.index))
        returns = _true_return(query.first), _true_return(query.second)
        felt = self._felt(query.first), self._felt(query.second)
        return self.judge(self.config, returns, felt, asked.segment_return or 0.0, rng)

    def _felt(self, segment: Segment) -> float:
        """Σ_t γ^(H−1−t) r_t."""
        if self.config.discount == 1:
            return _true_return(segment)
        rewards = rewards_from_bytes(self.store.read(segment.artifact_key, segment.checksum))
        return float(rewards @ self.config.discount ** np.arange(len(rewards) - 1, -1, -1))


def _true_return(segment: Segment) -> float:
    if segment.true_return is None:
        raise ValueError("a scripted teacher needs the environment's true reward, and this one has none")
    return segment.true_return


KINDS: dict[str, type[Scripted]] = {
    config.model_fields["kind"].default: config
    for config in (Oracle, Stochastic, Mistaken, Skipping, Equal, Myopic)
}
"""Scripted teachers by name; people answer on their own."""


def scripted_teacher_named(kind: str) -> Scripted:
    """The scripted teacher of that kind with its default faults; ValueError names the ones there are."""
    if kind not in KINDS:
        raise ValueError(f"{kind!r}: unknown; one of {', '.join(KINDS)}")
    return KINDS[kind]()


def answer_all(session: Session, name: str, teacher: ScriptedTeacher, queries: Sequence[Query]) -> None:
    """Answer the queries that teacher `name` has not answered, through leases as a person would.

    The answer's id follows from run, query and teacher, so that nothing is ever answered twice.
    """
    labeller = labeller_named(session, name, LabellerKind.SCRIPTED)
    now = utc_now()
    for query in queries:  # unanswered ones: what an earlier attempt posted it has answered as well
        lease = lend(session, query.id, labeller.id, now, swapped=False)
        session.flush()
        answer_query(
            session,
            lease.id,
            labeller.id,
            answer_id=str(uuid.uuid5(uuid.NAMESPACE_URL, f"{query.run_id}/{query.id}/{name}")),
            pressed=pressed_for(teacher(query), swapped=False),
            now=now,
        )
