"""Writes docs/configuration.md from the configuration's own classes; a test holds the two together."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path

from labels_db.config_fields import ConfigField, fields_of
from labels_db.overrides import variants_of
from labels_db.presets import presets
from labels_db.run_config import Config, RunConfig

HEAD = "| setting | default | allowed | meaning |\n|---|---|---|---|"
TARGET = Path(__file__).parent.parent / "docs" / "configuration.md"

INTRODUCTION = """\
# Configuration

<!-- Written by scripts/make_configuration_reference.py; edit the descriptions in labels_db/run_config/. -->

A run is an agent × a reward source × an exploration × a feedback. Every setting has a path, which is how the
dashboard's form, the API (`settings`) and the command line name it:

    pebble train walker-walk --set agent.width=128 --set feedback.scheme.kind=disagreement

Choosing another `kind` keeps the settings both have and takes the new one's defaults for the rest. What is
out of bounds or unknown is refused with the path, the value and what would be right. A run's configuration
never changes afterwards, except that it can be extended to more steps or a larger budget.

## Environment variables

| variable | meaning |
|---|---|
| `PEBBLE_DATA` | Folder with database, artifacts, logs and token; `./data` by default. `--data` overrides it. |

## Presets

| preset | profile | steps | answers | teacher |
|---|---|---|---|---|
"""


def preset_rows() -> Iterator[str]:
    for preset in presets().values():
        for profile, config in preset.profiles.items():
            teacher = getattr(config.feedback, "teacher", None)
            who = teacher.kind if teacher else "nobody"
            yield f"| `{preset.name}` | {profile} | {config.total_steps:,} | {config.budget:,} | {who} |"


def bounds(field: ConfigField) -> str:
    """Allowed values in words."""
    if field.choices:
        return ", ".join(f"`{choice}`" for choice in field.choices)
    if field.type == "bool":
        return "`true`, `false`"
    if field.minimum is None:
        return "text"
    sign = ">" if field.open_minimum else "≥"
    below = "<" if field.open_maximum else "≤"
    upper = "" if field.maximum is None else f", {below} {number(field.maximum)}"
    return f"{sign} {number(field.minimum)}{upper}" + (" or empty" if field.optional else "")


def number(value: float) -> str:
    return f"{int(value):,}" if value == int(value) else f"{value:g}"


def default(fields: Mapping[str, ConfigField]) -> str:
    """What most kinds have, and where another has something else."""
    values = {kind: value_in_words(field) for kind, field in fields.items()}
    ((usual, _),) = Counter(values.values()).most_common(1)
    others = [f"{kind}: {value}" for kind, value in values.items() if value != usual]
    return f"{usual} ({', '.join(others)})" if others else usual


def value_in_words(field: ConfigField) -> str:
    return "empty" if field.value in (None, "") else f"`{field.value}`"


def rows(config: Config, prefix: str) -> Iterator[str]:
    """One row for each setting that lies directly in this part."""
    for field in fields_of(config, prefix):
        if field.path.count(".") == prefix.count(".") or field.path.endswith(".kind"):
            yield f"| `{field.path}` | {value_in_words(field)} | {bounds(field)} | {field.description} |"


def parts_within(variants: Mapping[str, type[Config]], prefix: str) -> dict[str, Mapping[str, type[Config]]]:
    """The choices that lie in a choice, by path: who answers, and which queries are asked."""
    found: dict[str, Mapping[str, type[Config]]] = {}
    for variant in variants.values():
        for name, info in variant.model_fields.items():
            if len(kinds := variants_of(info.annotation)) > 1:
                found[f"{prefix}{name}"] = kinds
    return found


def part_within(path: str, kinds: Mapping[str, type[Config]]) -> Iterator[str]:
    """What each kind is, and the settings of all of them in one table."""
    yield f"### `{path}.kind`"
    yield "\n".join(f"- `{kind}`: {' '.join((made.__doc__ or '').split())}" for kind, made in kinds.items())
    fields: dict[str, dict[str, ConfigField]] = defaultdict(dict)
    for kind, made in kinds.items():
        for field in fields_of(made(), f"{path}."):
            fields[field.path][kind] = field
    table = [HEAD]
    for setting, by_kind in fields.items():
        only, first = next(iter(by_kind.items()))
        whose = f" Only `{only}`." if len(by_kind) == 1 else ""
        table.append(f"| `{setting}` | {default(by_kind)} | {bounds(first)} | {first.description}{whose} |")
    yield "\n".join(table)


def sections() -> Iterator[str]:
    yield "## The run\n\n" + "\n".join(
        [HEAD, *[r for r in rows(RunConfig(), "") if "." not in r.split("`")[1]]]
    )
    for name, info in RunConfig.model_fields.items():
        variants = variants_of(info.annotation)
        if variants:
            yield f"## {name}" + (f"\n\n{info.description}" if len(variants) > 1 else "")
        for kind, variant in variants.items():
            title = f"### `{name}.kind={kind}`\n\n" if "kind" in variant.model_fields else ""
            yield title + f"{(variant.__doc__ or '').strip()}"
            listed = [row for row in rows(variant(), f"{name}.") if f"`{name}.kind`" not in row]
            if listed:
                yield "\n".join([HEAD, *listed])
        for path, kinds in parts_within(variants, f"{name}.").items():
            yield from part_within(path, kinds)


def reference() -> str:
    return INTRODUCTION + "\n".join(preset_rows()) + "\n\n" + "\n\n".join(sections()) + "\n"


if __name__ == "__main__":
    TARGET.write_text(reference(), encoding="utf-8")
