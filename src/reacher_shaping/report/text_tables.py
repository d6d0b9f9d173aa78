"""Tables as people read them: headings and rows of text, for the report and the notebooks."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from reacher_shaping.labels import setting_label, stochastic, variant_label, variant_order
from reacher_shaping.report import paper_tables
from reacher_shaping.report.text import say


@dataclass(frozen=True)
class Grid:
    """A table to show: its headings, its rows, the columns that are text, and its numbers in full as CSV."""

    headings: list[str]
    rows: list[list[str]]
    texts: frozenset[int] = frozenset({0})
    csv: str = ""


def of_table(table: pd.DataFrame) -> Grid:
    """A table of `paper_tables` as `paper_tables.readable` reads it; names of cells and policies are text."""
    frame = paper_tables.readable(table)
    names = {paper_tables.HEADINGS[name] for name in ("setting", "policy")}
    texts = frozenset(place for place, heading in enumerate(frame.columns) if heading in names)
    return Grid(list(frame.columns), frame.to_numpy().tolist(), texts, paper_tables.to_csv(table))


def to_markdown(grid: Grid) -> str:
    """The grid for a notebook."""
    marks = [":--" if place in grid.texts else "--:" for place in range(len(grid.headings))]
    rows = grid.rows or [[say("tables.none"), *[""] * (len(grid.headings) - 1)]]
    lines = [" | ".join(row) for row in (grid.headings, marks, *rows)]
    return "\n".join(f"| {line} |" for line in lines)


def settings_grid(study: Mapping[str, Any], protocols: Collection[str] | None = None) -> Grid:
    """Settings and their sources: a row per setting, a column per protocol, of those named if any are."""
    every = study.get("protocols", {})
    sources = study.get("sources", {})
    shown = {name: settings for name, settings in every.items() if not protocols or name in protocols}
    flat = {name: _flatten({k: v for k, v in settings.items() if k != "name"}) for name, settings in shown.items()}
    keys = list(dict.fromkeys(key for settings in flat.values() for key in settings))
    rows = []
    for key in keys:
        texts = []
        for name, settings in flat.items():
            source = sources.get(f"protocols.{name}.{key.replace(': ', '.').replace(' ', '_')}")
            texts.append(plain(settings.get(key, "")) + (f" ({source})" if source else ""))
        rows.append([key, *texts])
    return Grid([say("tables.setting"), *(name.replace("_", " ") for name in flat)], rows)


def departures_grid(study: Mapping[str, Any]) -> Grid:
    """Settings in which the protocols differ, side by side."""
    values, grid = settings_grid({**study, "sources": {}}), settings_grid(study)
    rows = [row for value, row in zip(values.rows, grid.rows, strict=True) if len(set(value[1:])) > 1]
    return Grid(grid.headings, rows)


def _flatten(settings: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in settings.items():
        name = f"{prefix}{key.replace('_', ' ')}"
        flat |= _flatten(value, f"{name}: ") if isinstance(value, Mapping) else {name: value}
    return flat


def plain(value: Any) -> str:
    """A setting as people write it."""
    if value is None:
        return say("tables.unset")
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, list | tuple):
        return ", ".join(plain(entry) for entry in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def study_grid(cells: pd.DataFrame) -> Grid:
    """Seeds evaluated per variant (rows), budget and alpha0 (columns), with the count of those that diverged."""
    if cells.empty:
        return Grid([say("headings.variant")], [])
    counts = cells.pivot_table(index="variant", columns=["alpha0", "budget"], values=["seeds", "diverged"], sort=False)
    seeds, diverged = counts["seeds"], counts["diverged"]
    seeds = seeds.sort_index(axis="columns", level=[0, 1], ascending=[False, True])
    settings = [(float(pair[0]), int(pair[1])) for pair in seeds.columns.to_list()]
    rows = []
    for name in sorted(seeds.index, key=variant_order):
        pairs = zip(seeds.loc[name], diverged.loc[name, seeds.columns], strict=True)
        texts = ["" if np.isnan(count) else paper_tables.seed_count(count, lost) for count, lost in pairs]
        rows.append([variant_label(str(name)), *texts])
    return Grid([say("headings.variant"), *(setting_label(budget, alpha0) for alpha0, budget in settings)], rows)


def controllers_grid(controllers: pd.DataFrame | None, protocol: str | None = None) -> Grid | None:
    """Policies that need no learning, in the measures of the tables."""
    if controllers is None or controllers.empty:
        return None
    controllers = stochastic(controllers, protocol)
    keep = ["success_rate", "final_success_rate", "mean_return", "final_distance"]
    frame = paper_tables.readable(controllers[[name for name in keep if name in controllers]])
    names = [str(name).replace("_", " ") for name in controllers["controller"]]
    headings = [heading.removesuffix(" [95 % interval]") for heading in frame.columns]
    rows = [[name, *row] for name, row in zip(names, frame.to_numpy().tolist(), strict=True)]
    return Grid([say("headings.policy"), *headings], rows)
