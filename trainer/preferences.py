"""The preference dataset D as a pure function of the answers up to a cursor, in order."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import structlog
import torch

from labels_db.answers import answers_since
from labels_db.database import Database
from labels_db.models import Choice, Segment
from labels_db.storage import ArtifactError, ArtifactStore
from trainer.episodes import Array
from trainer.reward_model import Preferences
from trainer.segments import inputs_from_bytes

log = structlog.get_logger()

LABELS = {Choice.FIRST: 0.0, Choice.SECOND: 1.0, Choice.EQUAL: 0.5}
"""y of each choice; a skip says nothing."""


@dataclass(frozen=True)
class Said:
    """An answer, or (with `retracts`) the retraction of one."""

    id: int
    query_id: int
    choice: Choice | None
    retracts: int | None


def labels_of(answers: Iterable[Said]) -> dict[int, float]:
    """y by query id, in order: skips add nothing, several answers average, retracted ones go."""
    standing: dict[int, tuple[int, float]] = {}
    for said in answers:
        if said.retracts is not None:
            standing.pop(said.retracts, None)
        elif said.choice in LABELS:
            standing[said.id] = (said.query_id, LABELS[said.choice])
    given: dict[int, list[float]] = {}
    for query_id, label in standing.values():
        given.setdefault(query_id, []).append(label)
    return {query: sum(labels) / len(labels) for query, labels in given.items()}


def asked_about(answers: Iterable[Said]) -> set[int]:
    """Queries that ever had an answer to learn from, taken back since or not."""
    return {said.query_id for said in answers if said.choice in LABELS}


class AnsweredQueries:
    """Follows a run's answers, and keeps the segments they are about in memory."""

    def __init__(self, database: Database, store: ArtifactStore, run_id: str, device: torch.device) -> None:
        self.database = database
        self.store = store
        self.run_id = run_id
        self.device = device
        self._cursor = 0
        self._said: list[Said] = []
        self._inputs: dict[int, tuple[Array, Array]] = {}
        self._lost: set[int] = set()

    def up_to(self, cursor: int) -> tuple[dict[int, float], dict[int, float]]:
        """y by query of all answers up to the cursor, and of the queries first answered since the last call."""
        before = asked_about(self._said)  # who changes an answer was learned from before
        self._read(cursor)
        now = {query: y for query, y in labels_of(self._said).items() if query not in self._lost}
        return now, {query: y for query, y in now.items() if query not in before}

    def preferences(self, labels: dict[int, float]) -> Preferences:
        """Those queries as tensors."""
        first, second = (np.stack([self._inputs[query][side] for query in labels]) for side in (0, 1))
        return Preferences(
            torch.from_numpy(first).to(self.device),
            torch.from_numpy(second).to(self.device),
            torch.tensor(list(labels.values()), dtype=torch.float32, device=self.device),
        )

    def observations(self, size: int) -> torch.Tensor:
        """Both segments' observations of every preference up to the last cursor, [n, 2·H·D]."""
        known = [self._inputs[query] for query in labels_of(self._said) if query not in self._lost]
        rows = [np.concatenate([side[:, :size].ravel() for side in pair]) for pair in known]
        return torch.from_numpy(np.stack(rows)).to(self.device) if rows else torch.empty(0, 0)

    def _read(self, cursor: int) -> None:
        """Take in the answers up to the cursor; the record is left before segments are read, which takes its time."""
        with self.database.read() as session:
            answers = answers_since(session, self.run_id, self._cursor, cursor)
            said = [Said(answer.id, answer.query_id, answer.choice, answer.retracts) for answer in answers]
            new = asked_about(said) - self._inputs.keys()
            pairs = {a.query_id: (a.query.first, a.query.second) for a in answers if a.query_id in new}
        self._said += said
        self._cursor = max(self._cursor, cursor)
        for query_id, pair in pairs.items():
            self._load(query_id, *pair)

    def _load(self, query_id: int, first: Segment, second: Segment) -> None:
        try:
            self._inputs[query_id] = (self._segment(first), self._segment(second))
        except ArtifactError as error:
            self._lost.add(query_id)
            log.error("an answered query cannot be learned from", query=query_id, reason=str(error))

    def _segment(self, segment: Segment) -> Array:
        return inputs_from_bytes(self.store.read(segment.artifact_key, segment.checksum)).astype(np.float32)
