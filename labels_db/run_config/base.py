"""What every part of a configuration is."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo


class Config(BaseModel):
    """A frozen value that refuses keys it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


RECORDED = {"recorded": True}
"""Validation context of a configuration in the record: valid when it was asked for; its environment may be gone."""


def is_recorded(info: ValidationInfo) -> bool:
    return info.context == RECORDED


def primary(**constraints: Any) -> Any:
    """A field that a form shows first; the others wait behind "All settings"."""
    return Field(json_schema_extra={"primary": True}, **constraints)
