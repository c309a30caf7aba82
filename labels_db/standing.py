"""Which answers count: choices that no retraction has taken back."""

from __future__ import annotations

import functools

from sqlalchemy import ColumnElement, exists
from sqlalchemy.orm import aliased

from labels_db.models import Answer


@functools.cache  # building it anew costs more than running it
def standing() -> ColumnElement[bool]:
    """Condition on `Answer`: a choice that no retraction has taken back."""
    retraction = aliased(Answer)
    return Answer.choice.is_not(None) & ~exists().where(retraction.retracts == Answer.id)
