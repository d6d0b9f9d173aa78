"""How much a few seeds can show, in tables and sentences: power, variance, the lottery of one seed per cell.

Every number comes from the study's tables; here they are only counted, rounded and put into words.
"""

from typing import Any

import numpy as np
import pandas as pd

from reacher_shaping.analysis import comparisons, single_seed_studies
from reacher_shaping.labels import cell_order, number, of_protocol
from reacher_shaping.report import paper_tables
from reacher_shaping.report.text import entry, say
from reacher_shaping.report.text_tables import Grid

POWER = 0.8  # chance to see an effect that counts as enough, as `power.parquet` has it
MOST = 10_000  # seeds up to which `stats.seeds_needed` looks
CELL_HEADINGS = [say("headings.setting")]


def power_grid(power: pd.DataFrame, protocol: str | None = None) -> Grid:
    """A row per shaped cell of the table of powers: published gain, our deviation, power, and the seeds it takes."""
    headings = [*CELL_HEADINGS, *(text.format(power=POWER) for text in entry("tables.power"))]
    rows = [
        [
            *_cell(row),
            _text(100 * row["published_gain"], 1),
            _text(100 * row["deviation"], 1),
            f"{row['seeds']:.0f}",
            _text(row["power"], 2),
            _text(row["power_3"], 2),
            _needed(row),
        ]
        for row in _sorted(of_protocol(power, protocol))
    ]
    return Grid(headings, rows)


def power_sentence(power: pd.DataFrame, protocol: str | None = None) -> str:
    """What the table of powers says: in how many cells the published gain could be told from chance."""
    known = of_protocol(power, protocol).dropna(subset="deviation")
    if known.empty:
        return say("seeds.power_unknown")
    seeds = sorted(known["seeds"].unique())
    ours = f"{seeds[0]:.0f}" if len(seeds) == 1 else _span(f"{seeds[0]:.0f}", f"{seeds[-1]:.0f}")
    middle = comparisons.median_seeds_needed(known)
    needed = f"{np.ceil(middle):,.0f}" if np.isfinite(middle) else say("seeds.more_than", count=f"{MOST:,}")
    enough, three = ((known[name] >= POWER).sum() for name in ("power", "power_3"))
    return say("seeds.power", ours=ours, power=POWER, enough=enough, cells=len(known), three=three, needed=needed)


def _needed(row: dict[Any, Any]) -> str:
    if not np.isfinite(row["deviation"]):
        return _text(np.nan)
    return f"{row['seeds_needed']:,.0f}" if np.isfinite(row["seeds_needed"]) else say("seeds.over", count=f"{MOST:,}")


def variance_grid(variance: pd.DataFrame, protocol: str | None = None) -> Grid:
    """A row per cell: standard deviations of the success rate from seeds and from evaluation, and the seeds' share."""
    headings = [*CELL_HEADINGS, *entry("tables.variance")]
    own = of_protocol(variance, protocol)
    rows = [
        [
            *_cell(row),
            f"{row['seeds']:.0f}",
            _text(100 * np.sqrt(row["seed_variance"]), 1),
            _text(100 * np.sqrt(row["evaluation_variance"]), 1),
            _percent(row["share"]),
        ]
        for row in _sorted(own.assign(share=comparisons.seed_shares(own)))
    ]
    return Grid(headings, rows)


def variance_sentence(variance: pd.DataFrame, protocol: str | None = None) -> str:
    """What the table of variances says: would more seeds or more evaluation episodes narrow the intervals?"""
    shares = comparisons.seed_shares(of_protocol(variance, protocol))
    if not shares.notna().any():
        return say("seeds.variance_unknown")
    low, middle, high = comparisons.extent(shares)
    sources = entry("seeds.sources")
    more, other = sources if middle > 0.5 else reversed(sources)
    least, most = _percent(low), _percent(high)
    return say("seeds.variance", middle=_percent(middle), least=least, most=most, more=more, other=other)


def winners_grid(winners: pd.DataFrame) -> Grid:
    """How often each cell is the best of a study with one seed per cell, most often first."""
    rows = [[*_cell(row), _percent(row["share"], 1)] for row in winners.to_dict("records")]
    return Grid([*CELL_HEADINGS, *entry("tables.winners")], rows)


def winners_sentence(winners: pd.DataFrame) -> str:
    """Which cell would win most often, and how far that is from always."""
    if winners.empty:
        return say("seeds.winners_unknown")
    first = winners.sort_values("share", ascending=False).iloc[0]
    name = paper_tables.cell_label(first.to_dict())
    return say("seeds.winners", cells=len(winners), name=name, share=_percent(first["share"], 1))


def spread_grid(spread: pd.DataFrame, published: pd.DataFrame) -> Grid:
    """Quantiles of what studies with one seed per cell report, the published value beside.

    `published` comes from `paper_tables.published_cells`; it is itself such a study.
    """
    study = single_seed_studies.single_seed_studies(published.assign(seed=0), np.random.default_rng(0), studies=1)
    theirs = study.iloc[0].to_dict() if len(study) else {}
    levels = [str(name) for name in spread if name != "quantity"]
    rows = []
    for row in spread.to_dict("records"):
        name = row["quantity"]
        factor = 100 if name == "best_success" else 1
        values = [factor * value for value in (*(row[level] for level in levels), theirs.get(name, np.nan))]
        rows.append([entry("quantities").get(name, name), *(_text(value, 2) for value in values)])
    headings = [f"{level.removeprefix('q').lstrip('0')} %" for level in levels]
    first, last = entry("tables.spread")
    return Grid([first, *headings, last], rows)


def _span(first: str, last: str) -> str:
    return say("seeds.span", first=first, last=last)


def _sorted(frame: pd.DataFrame) -> list[dict[Any, Any]]:
    return sorted(frame.to_dict("records"), key=cell_order)


def _cell(row: dict[Any, Any]) -> list[str]:
    return [paper_tables.cell_label(row)]


def _text(value: float, digits: int = 3) -> str:
    return number(value, digits) if pd.notna(value) else "\N{EN DASH}"


def _percent(value: float, digits: int = 0) -> str:
    return f"{_text(100 * value, digits)}\N{NO-BREAK SPACE}%" if pd.notna(value) else "\N{EN DASH}"
