"""What the API says when it does not do what it was asked, described for its OpenAPI document."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, Field


class Complaint(BaseModel):
    """One thing that was wrong with a request."""

    field: str = Field(description="Path of the field to blame; empty where no single one is.")
    reason: str = Field(description="What is wrong, in plain words.")


class Complaints(BaseModel):
    """The body of every 4xx answer."""

    detail: list[Complaint]


Responses = dict[int | str, dict[str, Any]]


def refusal(status: int, meaning: str) -> Responses:
    """A status with what it means; its body says more."""
    return {status: {"model": Complaints, "description": meaning}}


REFUSED = (
    refusal(400, "The body cannot be read.")
    | refusal(401, "No token, or an old one.")
    | refusal(403, "Sent by a page of another site.")
    | refusal(413, "The body is too large.")
    | refusal(422, "Something sent does not fit; the field and the reason.")
)
UNKNOWN = refusal(404, "There is no such thing.")
NOT_NOW = refusal(409, "The run's present state does not allow it.")
