"""Changing a configuration by paths, as `--set feedback.budget=50` and the dashboard's form do."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from itertools import pairwise
from typing import Annotated, Any, cast, get_args, get_origin

from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from labels_db.run_config import Config, RunConfig

Settings = Mapping[str, str]
"""Values by path, as `--set` takes them."""


class SettingError(ValueError):
    """A setting's path or value is wrong; `path` names it."""

    def __init__(self, path: str, message: str) -> None:
        super().__init__(f"{path}: {message}" if path else message)
        self.path = path
        self.message = message


def with_settings(config: RunConfig, settings: Settings) -> RunConfig:
    """The configuration with those values; SettingError names the first that is unknown or out of bounds.

    Kinds come first: choosing another `kind` takes its defaults, and keeps what had been chosen for the old one.
    """
    tree = config.model_dump()
    for path in sorted(settings, key=_kinds_first):
        _set(tree, path, settings[path])
    try:
        return RunConfig.model_validate(tree)
    except ValidationError as error:
        raise setting_error(error) from error


def with_kinds(config: RunConfig, settings: Settings) -> RunConfig:
    """The configuration with the kinds among the settings, for showing only: its fit is not checked.

    A kind of a part that the others leave no place for is passed over.
    """
    tree = config.model_dump()
    for path in sorted((path for path in settings if path.endswith(".kind")), key=_kinds_first):
        with suppress(SettingError):
            _set(tree, path, settings[path])
    fields = RunConfig.model_fields.items()
    parts = {
        name: TypeAdapter[Any](cast(Any, info.annotation)).validate_python(tree[name])
        for name, info in fields
    }
    return RunConfig.model_construct(**parts)


def _kinds_first(path: str) -> tuple[bool, int]:
    return path.split(".")[-1] != "kind", path.count(".")


def setting_error(error: ValidationError) -> SettingError:
    """The first complaint of pydantic, as the path a person would type and a plain sentence."""
    return setting_errors(error)[0]


def setting_errors(error: ValidationError) -> list[SettingError]:
    """Every complaint of pydantic."""
    kinds = {kind for kind, _ in _all_variants(RunConfig)}
    return [SettingError(_path(found["loc"], kinds), _plain(found)) for found in error.errors()]


def _path(location: tuple[int | str, ...], kinds: set[str]) -> str:
    """The location without the kinds that pydantic adds after names; `behaviour` is both kind and name."""
    parts = pairwise(("", *map(str, location)))
    return ".".join(part for before, part in parts if part not in kinds or before in kinds)


_PLAIN = {
    "int_parsing": "needs a whole number",
    "int_type": "needs a whole number",
    "int_from_float": "needs a whole number",
    "float_parsing": "needs a number",
    "float_type": "needs a number",
    "finite_number": "needs a finite number",
    "bool_parsing": "needs true or false",
    "bool_type": "needs true or false",
    "string_type": "needs a word",
    "greater_than_equal": "must be at least {ge}",
    "greater_than": "must be more than {gt}",
    "less_than_equal": "must be at most {le}",
    "less_than": "must be less than {lt}",
    "literal_error": "must be {expected}",
    "extra_forbidden": "is not a setting",
}


def _plain(found: ErrorDetails) -> str:
    given = found["input"]
    if found["type"] not in _PLAIN:
        message = found["msg"].removeprefix("Value error, ")
        ours = found["type"] == "value_error"  # such a message names the value itself
        return message if ours or isinstance(given, dict) else f"{given!r} is refused: {message}"
    message = _PLAIN[found["type"]].format_map(found.get("ctx", {}))
    return f"{message}, and is empty" if given is None else f"{message}, not {given!r}"


def _set(tree: dict[str, Any], path: str, value: str) -> None:
    *parents, leaf = path.split(".")
    if leaf == "kind" and parents:
        _choose_kind(tree, parents, path, value)
        return
    part, model = _part(tree, parents, path)
    if variants_of(_annotation(model, leaf, path)):
        raise SettingError(path, f"has settings of its own; set one of those, as in {path}.kind")
    part[leaf] = None if value == "" else value


def _choose_kind(tree: dict[str, Any], parents: list[str], path: str, kind: str) -> None:
    """Another kind, with its own defaults; what had been chosen for the old one stays where it fits."""
    owner, model = _part(tree, parents[:-1], path)
    variants = variants_of(_annotation(model, parents[-1], path))
    if kind not in variants:
        raise SettingError(path, f"{kind!r} is unknown; one of {', '.join(variants)}")
    before, fresh = owner[parents[-1]], variants[kind]().model_dump()
    usual = variants[before.get("kind", kind)]().model_dump()
    chosen = {name: value for name, value in before.items() if name in fresh and value != usual[name]}
    kept = {name: value for name, value in chosen.items() if _suits(variants[kind], name, value)}
    owner[parents[-1]] = {**fresh, **kept, "kind": kind}


def _suits(model: type[Config], name: str, value: Any) -> bool:
    """Whether a value can be kept: a task of the suite is none of Meta-world's."""
    try:
        model.model_validate({name: value})
    except ValidationError:
        return False
    return True


def _part(tree: dict[str, Any], names: list[str], path: str) -> tuple[dict[str, Any], type[Config]]:
    """The part of the configuration that the names lead to, with its class."""
    part, model = tree, cast(type[Config], RunConfig)
    for name in names:
        variants = variants_of(_annotation(model, name, path))
        if not variants:
            raise SettingError(path, f"{name!r} has no settings below it")
        part = part[name]
        model = variants[part["kind"]] if "kind" in part else next(iter(variants.values()))
    return part, model


def _annotation(model: type[Config], name: str, path: str) -> Any:
    if name not in model.model_fields:
        close = difflib.get_close_matches(name, model.model_fields, n=1)
        hint = f"did you mean {close[0]}?" if close else f"one of {', '.join(model.model_fields)}"
        raise SettingError(path, f"unknown setting {name!r}; {hint}")
    return model.model_fields[name].annotation


def variants_of(annotation: Any) -> dict[str, type[Config]]:
    """The configuration classes a field may hold, by kind (by name where there is just one without a kind)."""
    if get_origin(annotation) is Annotated:
        return variants_of(get_args(annotation)[0])
    options = get_args(annotation) if get_args(annotation) else (annotation,)
    classes = [option for option in options if isinstance(option, type) and issubclass(option, Config)]
    return {_kind(option): option for option in classes}


def _kind(model: type[Config]) -> str:
    return str(model.model_fields["kind"].default) if "kind" in model.model_fields else model.__name__


def _all_variants(model: type[BaseModel]) -> Iterator[tuple[str, type[Config]]]:
    for field in model.model_fields.values():
        for kind, variant in variants_of(field.annotation).items():
            yield kind, variant
            yield from _all_variants(variant)
