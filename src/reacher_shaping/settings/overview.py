"""All settings of a study on one page, resolved, for a dry run."""

from collections.abc import Iterator, Mapping
from typing import Any

from reacher_shaping.settings.study import Study


def overview(study: Study) -> str:
    """A row per setting with a column per protocol, then variants, cells of each study, and what all of them share."""
    protocols = {name: dict(_flat(settings.model_dump(exclude={"name"}))) for name, settings in study.protocols.items()}
    keys = next(iter(protocols.values()))
    rows = [["", *protocols], *([key, *(_text(own[key]) for own in protocols.values())] for key in keys)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    lines += [
        f"variants.{name}: {_pairs(variant.model_dump(exclude={'name'}))}" for name, variant in study.variants.items()
    ]
    lines.append(f"evaluation: {_pairs(study.evaluation.model_dump())}")
    lines.append(f"root_seed: {study.root_seed}, seeds: {study.seeds}, cells: {len(study.cells)}")
    for name, own in study.experiments.items():
        lines.append(f"experiments.{name}: seeds: {own.seeds}, cells: {len(study.cells_of[name])}")
    return "\n".join(lines)


def _flat(settings: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in settings.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _pairs(settings: Mapping[str, Any]) -> str:
    return ", ".join(f"{key}: {_text(value)}" for key, value in settings.items() if value is not None)


def _text(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else f"{value:g}" if isinstance(value, float) else str(value)
