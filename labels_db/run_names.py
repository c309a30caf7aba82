"""The runs by name only, to choose among: however many there are, one light query."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from labels_db.models import ExperimentTitle, Run


@dataclass(frozen=True)
class RunName:
    """What a run is called: its title, with its id where others have the same."""

    id: str
    name: str


@dataclass(frozen=True)
class RunGroup:
    """Runs of one experiment, under its title, or those of none."""

    title: str | None
    runs: Sequence[RunName]


def runs_besides(session: Session, run_ids: Collection[str]) -> list[RunGroup]:
    """Every other run that is not archived: those of no experiment first, then the newest experiment."""
    kept = select(Run.id, Run.title, Run.experiment).where(~Run.archived)
    rows = session.execute(kept.order_by(Run.created_at.desc(), Run.id)).all()
    same = Counter(title for _, title, _ in rows)
    groups: dict[str | None, list[RunName]] = defaultdict(list, {None: []})
    for run_id, title, experiment in rows:
        if run_id not in run_ids:
            groups[experiment].append(RunName(run_id, title if same[title] == 1 else f"{title} ({run_id})"))
    titles = {kept.experiment: kept.title for kept in session.scalars(select(ExperimentTitle))}
    return [
        RunGroup(name and titles.get(name, name), runs if name is None else runs[::-1])
        for name, runs in groups.items()
        if runs
    ]
