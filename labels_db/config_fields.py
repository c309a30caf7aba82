"""A configuration as a flat list of fields with words and bounds: what forms show and the reference prints."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from labels_db.overrides import variants_of
from labels_db.run_config import Config


@dataclass(frozen=True)
class ConfigField:
    """One setting. `choices` is set where only certain words are allowed; bounds are inclusive unless open."""

    path: str
    description: str
    value: Any
    type: Literal["int", "float", "bool", "text", "choice"]
    optional: bool = False
    primary: bool = False
    minimum: float | None = None
    maximum: float | None = None
    open_minimum: bool = False
    open_maximum: bool = False
    choices: dict[str, str] = field(default_factory=dict)

    @property
    def section(self) -> str:
        """The part of the configuration it belongs to; "" for the run itself."""
        return self.path.partition(".")[0] if "." in self.path else ""


def fields_of(config: Config, prefix: str = "") -> Iterator[ConfigField]:
    """Every setting of the configuration, in the order of its classes; a kind comes before its fields."""
    for name, info in type(config).model_fields.items():
        path, value = f"{prefix}{name}", getattr(config, name)
        if isinstance(value, Config):
            yield from _part(path, info, value)
        elif name != "kind":
            yield _leaf(path, info, value)


def _part(path: str, info: FieldInfo, value: Config) -> Iterator[ConfigField]:
    variants = variants_of(info.annotation)
    if len(variants) > 1:
        yield ConfigField(
            path=f"{path}.kind",
            description=info.description or "",
            value=getattr(value, "kind", ""),
            type="choice",
            primary=_is_primary(info),
            choices={kind: (variant.__doc__ or "").strip() for kind, variant in variants.items()},
        )
    yield from fields_of(value, f"{path}.")


def _leaf(path: str, info: FieldInfo, value: Any) -> ConfigField:
    plain, optional = _without_none(info.annotation)
    literals = get_args(plain) if get_origin(plain) is Literal else ()
    bounds = {
        name: getattr(m, name) for m in info.metadata for name in ("ge", "gt", "le", "lt") if hasattr(m, name)
    }
    return ConfigField(
        path=path,
        description=info.description or "",
        value=value,
        type="choice" if literals else _TYPES[plain],
        optional=optional,
        primary=_is_primary(info),
        minimum=bounds.get("ge", bounds.get("gt")),
        maximum=bounds.get("le", bounds.get("lt")),
        open_minimum="gt" in bounds,
        open_maximum="lt" in bounds,
        choices={str(word): str(word) for word in literals},
    )


_TYPES: dict[Any, Literal["int", "float", "bool", "text"]] = {
    int: "int",
    float: "float",
    bool: "bool",
    str: "text",
}


def _without_none(annotation: Any) -> tuple[Any, bool]:
    if get_origin(annotation) not in (Union, UnionType):
        return annotation, False
    kept = [option for option in get_args(annotation) if option is not type(None)]
    return kept[0], len(kept) < len(get_args(annotation))


def _is_primary(info: FieldInfo) -> bool:
    extra = info.json_schema_extra
    return isinstance(extra, dict) and bool(extra.get("primary"))
