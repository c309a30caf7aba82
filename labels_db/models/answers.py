"""Who answers, what is lent to them meanwhile, and what they said."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import ForeignKey, Index, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column, relationship

from labels_db.models.base import Base
from labels_db.models.queries import Query
from labels_db.models.words import Choice, LabellerKind, Pressed


class Labeller(Base):
    """Somebody, or some script, that answers."""

    __tablename__ = "labellers"
    __table_args__ = (UniqueConstraint("kind", "name"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str]
    kind: Mapped[LabellerKind] = mapped_column(default=LabellerKind.PERSON)
    created_at: Mapped[datetime]


class Invite(Base):
    """A link with which a labeller joins one run without the operator's token."""

    __tablename__ = "invites"

    id: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id"), index=True)
    token_hash: Mapped[str] = mapped_column(unique=True)
    labeller_id: Mapped[int | None] = mapped_column(ForeignKey("labellers.id"))
    created_at: Mapped[datetime]
    expires_at: Mapped[datetime]
    revoked_at: Mapped[datetime | None]


class Lease(Base):
    """A query lent to one labeller for a while, and which side its first segment is shown on."""

    __tablename__ = "leases"
    __table_args__ = (Index("ix_leases_query_expiry", "query_id", "expires_at"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    query_id: Mapped[int] = mapped_column(ForeignKey("queries.id"))
    labeller_id: Mapped[int] = mapped_column(ForeignKey("labellers.id"), index=True)
    swapped: Mapped[bool]
    granted_at: Mapped[datetime]
    expires_at: Mapped[datetime]

    query: Mapped[Query] = relationship()
    answer: Mapped[Answer | None] = relationship(back_populates="lease")


class Answer(Base):
    """What one labeller chose, or the retraction of it. Rows are added, never changed."""

    __tablename__ = "answers"
    __table_args__ = (UniqueConstraint("run_id", "sequence"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id"))
    query_id: Mapped[int] = mapped_column(ForeignKey("queries.id"), index=True)
    labeller_id: Mapped[int] = mapped_column(ForeignKey("labellers.id"))
    sequence: Mapped[int]
    answer_id: Mapped[str] = mapped_column(unique=True)
    lease_id: Mapped[int | None] = mapped_column(ForeignKey("leases.id"), unique=True)
    choice: Mapped[Choice | None]
    pressed: Mapped[Pressed | None]
    retracts: Mapped[int | None] = mapped_column(ForeignKey("answers.id"), unique=True)
    goal_card_version: Mapped[int | None]
    shown_at: Mapped[datetime | None]
    answered_at: Mapped[datetime]

    lease: Mapped[Lease | None] = relationship(back_populates="answer")
    query: Mapped[Query] = relationship()
    labeller: Mapped[Labeller] = relationship()
