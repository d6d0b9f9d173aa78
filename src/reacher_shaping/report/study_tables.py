"""The tables of the further studies, as the report shows them: a measure with its interval in each entry."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from reacher_shaping.analysis.switch_effects import log_span
from reacher_shaping.figures.studies import KINDS, protocol_label, switch_label
from reacher_shaping.labels import (
    CELL,
    KEY,
    budget_label,
    cell_order,
    number,
    of_protocol,
    setting_label,
    variant_label,
)
from reacher_shaping.report import paper_tables
from reacher_shaping.report.quantities import in_words
from reacher_shaping.report.text import entry, say
from reacher_shaping.report.text_tables import Grid, of_table

METRICS = ("success_rate", "unit_return", "final_distance")
SHAPING = ("success_rate", "final_success_rate", "mean_return", "final_distance", "area_under_curve")
PAIRS = (("alpha0", "mean_return"), ("success_rate", "mean_return"), ("success_rate", "budget"))
LOGGED = {"peak_iteration": 0, "peak_return": 1, "final_return": 1}
DASH = "\N{EN DASH}"


def decimals(metric: str) -> tuple[int, float]:
    """Decimals of a measure, and the factor it is shown with: shares in per cent, distances in mm."""
    if metric.endswith("rate"):
        return 1, 100.0
    return (1, 1000.0) if metric.endswith("distance") else (2, 1.0)


def interval(row: Mapping[Any, Any], name: str, low: str, high: str, digits: int, factor: float = 1.0) -> str:
    """A number with its limits, from three columns of a row."""
    if pd.isna(row[name]):
        return DASH
    text = number(factor * row[name], digits)
    if pd.isna(row[low]):
        return text
    return f"{text} [{number(factor * row[low], digits)}, {number(factor * row[high], digits)}]"


def p_value(value: float) -> str:
    """A p value as it is printed."""
    return DASH if pd.isna(value) else "< 0.001" if value < 0.001 else number(value, 3)


def effects(table: pd.DataFrame) -> Grid:
    """A row per switch, variant and kind of effect; for each measure the difference and its corrected p."""
    rows = []
    kinds = {**KINDS, "interaction": say("study_sentences.difference_of_kinds")}
    for (switch, variant, kind), own in table.groupby(["switch", "variant", "effect"], sort=False):
        by_metric = {str(row["metric"]): row for row in own.to_dict("records")}
        first = next(iter(by_metric.values()))
        entries = [switch_label(first), variant_label(str(variant)), kinds[str(kind)]]
        for metric in METRICS:
            row, (digits, factor) = by_metric[metric], decimals(metric)
            entries += [interval(row, "difference", "ci_low", "ci_high", digits, factor), p_value(row["p_holm"])]
        rows.append((list(dict.fromkeys(table["switch"])).index(switch), entries))
    headings = list(entry("tables.effects"))
    headings += [text for metric in METRICS for text in (entry("measures")[metric], "p")]
    return Grid(headings, [entries for _, entries in sorted(rows, key=lambda row: row[0])], frozenset({0, 1, 2}))


def lengths(table: pd.DataFrame) -> Grid:
    """A row per cell and length of episodes: where the tip is at the end, and how much of the time on the target."""
    rows = []
    for row in table.to_dict("records"):
        texts = [
            interval(row, name, f"{name}_low", f"{name}_high", *decimals(name))
            for name in ("success_rate", "final_success_rate", "share_within_radius", "final_distance")
        ]
        named = [protocol_label(row["protocol"]), variant_label(row["variant"])]
        rows.append([*named, setting_label(row["budget"], row["alpha0"]), str(row["steps"]), *texts])
    return Grid(list(entry("tables.lengths")), rows, frozenset({0, 1, 2}))


def hypothesis_cell(name: str) -> str:
    """`sparse20 l2 50`, as the table of hypotheses names a cell, as people read it."""
    protocol, variant, alpha0 = name.split(" ")
    weight = [] if variant == "none" else [f"α₀ = {alpha0}"]
    return ", ".join([protocol_label(protocol), variant_label(variant), *weight])


def hypotheses(table: pd.DataFrame) -> Grid:
    """A row per hypothesis: what it says, both cells, their difference with interval and p, and the verdict."""
    rows = []
    for row in table.to_dict("records"):
        means = [f"{hypothesis_cell(row[side])}: {number(100 * row[f'mean_{side}'], 1)} %" for side in ("a", "b")]
        counts = {f"solved_{side}": round(row[f"solved_{side}"] * row["runs"]) for side in ("a", "b")}
        solved = say("study_sentences.solved", **counts, runs=f"{row['runs']:.0f}")
        apart = interval(row, "difference", "ci_low", "ci_high", 1, 100.0)
        rows.append([row["id"], in_words(row["claim"]), *means, apart, p_value(row["p_holm"]), solved, row["verdict"]])
    return Grid(list(entry("tables.hypotheses")), rows, frozenset({0, 1, 2, 3, 7}))


def correlation(table: pd.DataFrame, main: pd.DataFrame | None = None) -> Grid:
    """A row per pair of the paper: published, over the same cells and over all of the study, single seeds.

    The last column is the main study's, whose start weights are what they say.
    """
    rows = []
    for x, y in PAIRS:
        own = table[(table["method"] == "pearson") & (table["x"] == x) & (table["y"] == y)]
        by_level = {row["level"]: row for row in own.to_dict("records")}
        seeds = own[own["level"].str.startswith("seed")]["r"].dropna()
        span = f"{number(seeds.min(), 2)} to {number(seeds.max(), 2)}" if len(seeds) else DASH
        texts = [
            interval(by_level[level], "r", "ci_low", "ci_high", 2) if level in by_level else DASH
            for level in ("published", "cells", "cells_all")
        ]
        rows.append([entry("pairs")[f"{x}-{y}"], *texts, span, _main_correlation(main, x, y)])
    return Grid(list(entry("tables.correlation")), rows)


def _main_correlation(main: pd.DataFrame | None, x: str, y: str) -> str:
    if main is None:
        return DASH
    ours = of_protocol(main, None)
    ours = ours[(ours["method"] == "pearson") & (ours["level"] == "cells") & (ours["x"] == x) & (ours["y"] == y)]
    return interval(ours.iloc[0].to_dict(), "r", "ci_low", "ci_high", 2) if len(ours) else DASH


def beside(cells: pd.DataFrame, published: pd.DataFrame) -> Grid:
    """A row per published run: its success and return, and ours of the cell of the same label."""
    rows = []
    joined = published.merge(cells, on=CELL, suffixes=("_published", ""))
    for row in sorted(joined.to_dict("records"), key=cell_order):
        texts = [str(row["run"]), variant_label(row["variant"]), setting_label(int(row["budget"]), row["alpha0"])]
        for metric in ("success_rate", "mean_return"):
            digits, factor = decimals(metric)
            texts.append(number(factor * row[f"{metric}_published"], digits))
            texts.append(interval(row, metric, f"{metric}_low", f"{metric}_high", digits, factor))
        rows.append(texts)
    return Grid(list(entry("tables.beside")), rows, frozenset({0, 1, 2}))


def logs(table: pd.DataFrame, training_logs: pd.DataFrame) -> Grid:
    """A row per cell, and a row per published log of one of them."""

    def span(values: "pd.Series[float]", digits: int) -> str:
        mean, low, high = (number(value, digits) for value in log_span(values))
        return f"{mean} [{low}, {high}]"

    rows = []
    groups = table.groupby(KEY, sort=False)
    ordered = sorted(groups, key=lambda group: (group[1]["protocol"].iloc[0], cell_order(group[1].iloc[0].to_dict())))
    for _, own in ordered:
        cell = own.iloc[0].to_dict()
        texts = [span(own[name], digits) for name, digits in LOGGED.items()]
        texts.append(span(own["action_std"], 2))
        setting = setting_label(int(cell["budget"]), cell["alpha0"])
        rows.append([protocol_label(cell["protocol"]), variant_label(cell["variant"]), setting, *texts])
    keys = ["protocol", "variant", "budget"]
    cells = set(table.loc[table["alpha0"] == 1, keys].itertuples(index=False, name=None))
    for run in training_logs.to_dict("records"):
        if tuple(run[name] for name in keys) not in cells:
            continue
        texts = [number(run[name], digits) for name, digits in LOGGED.items()]
        setting = budget_label(int(run["budget"]))
        std = say("study_sentences.two", first=number(run["std_1"], 2), second=number(run["std_2"], 2))
        rows.append(
            [
                say("study_sentences.published_log", run=run["run"]),
                variant_label(str(run["variant"])),
                setting,
                *texts,
                std,
            ]
        )
    return Grid(list(entry("tables.logs")), rows, frozenset({0, 1, 2}))


def agreement(table: pd.DataFrame) -> Grid:
    """A row per measure: ours, theirs, the difference with its interval, p."""
    rows = []
    for row in table.to_dict("records"):
        digits, factor = decimals(row["metric"])
        means = [number(factor * row[name], digits) for name in ("ours", "theirs")]
        difference = interval(row, "difference", "ci_low", "ci_high", digits, factor)
        rows.append([entry("measures")[row["metric"]], *means, difference, p_value(row["p"]), p_value(row["p_holm"])])
    return Grid(list(entry("tables.agreement")), rows)


def shaping(shaped: pd.DataFrame) -> Grid:
    """A row per shaped cell: its paired difference to `none` in each measure, with the corrected p."""
    rows = []
    ordered = sorted(shaped.to_dict("records"), key=lambda row: (row["protocol"], cell_order(row)))
    by_cell: dict[tuple[Any, ...], dict[str, dict[Any, Any]]] = {}
    for row in ordered:
        key = (row["protocol"], row["variant"], row["budget"], row["alpha0"])
        by_cell.setdefault(key, {})[row["metric"]] = row
    for (protocol, variant, budget, alpha0), own in by_cell.items():
        entries = [protocol_label(protocol), variant_label(variant), setting_label(int(budget), alpha0)]
        for metric in SHAPING:
            digits, factor = decimals(metric)
            entries.append(interval(own[metric], "difference", "ci_low", "ci_high", digits, factor))
            entries.append(p_value(own[metric]["p_holm"]))
        rows.append(entries)
    headings = [*entry("tables.shaping"), *(text for name in SHAPING for text in (entry("measures")[name], "p"))]
    return Grid(headings, rows, frozenset({0, 1, 2}))


def cells(table: pd.DataFrame) -> Grid:
    """Every cell with the measures of the study's tables, protocol by protocol."""
    order = list(dict.fromkeys(table["protocol"]))
    rows = sorted(table.to_dict("records"), key=lambda row: (order.index(row["protocol"]), *cell_order(row)))
    frame = pd.DataFrame(rows, columns=table.columns)
    frame["policy"] = [protocol_label(name) for name in frame["protocol"]]
    keep = ["policy", "variant", "budget", "alpha0", "seeds", "diverged"]
    keep += [f"{name}{end}" for name in paper_tables.MEASURED for end in ("", "_low", "_high")]
    grid = of_table(frame[keep])
    places = [1, 0, *range(2, len(grid.headings))]  # the protocol first
    headings = [grid.headings[place] for place in places]
    rows_shown = [[row[place] for place in places] for row in grid.rows]
    return Grid([say("tables.protocol"), *headings[1:]], rows_shown, grid.texts, grid.csv)
