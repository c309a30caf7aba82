"""Use case around goal cards: what labellers are asked to look for can be put better while a run goes on."""

from __future__ import annotations

from sqlalchemy.orm import Session

from labels_db.models import GoalCard, utc_now
from labels_db.runs import get_run, note


def change_goal(session: Session, run_id: str, text: str) -> GoalCard:
    """A new version of the run's goal card; the same text again changes nothing."""
    run = get_run(session, run_id)
    latest = run.goal
    if text == latest.text:
        return latest
    card = GoalCard(version=latest.version + 1, text=text, created_at=utc_now())
    run.goal_cards.append(card)
    note(session, run, f"The goal is now: {text}")
    session.flush()
    return card
