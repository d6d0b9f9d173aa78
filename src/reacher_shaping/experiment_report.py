"""The further studies in the report: for each, what it asks, sentences and tables from its files, and its figures.

Every number comes from the experiment's tables; here they are only chosen, rounded and put into words.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from reacher_shaping import artifacts, grids, tables
from reacher_shaping.experiment_figures import KINDS, protocol_label, switch_label
from reacher_shaping.grids import Grid, of_table
from reacher_shaping.style import budget_label, cell_order, number, setting_label, variant_label

LEVEL = 0.05
SCHEMAS = {
    "runs": artifacts.RUNS,
    "cells": artifacts.CELLS,
    "controllers": artifacts.CONTROLLERS,
    "curves": artifacts.CURVES,
    "logged": artifacts.CURVES,
    "logs": artifacts.LOGS,
    "comparisons": artifacts.COMPARISONS,
    "correlation": artifacts.CORRELATION,
    "effects": artifacts.EFFECTS,
    "agreement": artifacts.AGREEMENT,
}
TITLES = {
    "released": "The study as the released code computes it",
    "attribution": "What each departure does",
    "standard": "Does shaping help once PPO works?",
    "tuned": "How good can it get?",
}
INTROS = {
    "released": "The text and the code released with it differ in a few places, as easily happens: the weight of the "
    "control cost (D1), an axis too many that pairs every new probability of a minibatch with every old one (D2), a "
    "recursion whose carry is not stored, so that advantages look one step ahead (D3), a learning rate that changes "
    "with a late commit (D4), a log of the shaped return over the last ten episodes (D5), the potential under a decay "
    "(D6), and a start weight α₀ that is a label: every run starts at 1 (D7). Here the cells of Table 2 are trained as "
    "that code trains them; the runs labelled 0.5 have the late commit's learning rate. The labels are the published.",
    "attribution": "Both ends and, between them, every switch alone from the text, and taken back alone from the "
    "release. If switches acted independently, the two would agree.",
    "standard": "The same variants under settings that are usual for PPO on this task: a network each for policy and "
    "value, orthogonal first weights, clipped actions, values bootstrapped at the time limit, no entropy bonus.",
    "tuned": "PPO and shaping settings searched on seeds of their own, then trained on fresh ones, with the parts of "
    "the change taken back one by one.",
}
METRICS = {"success_rate": (3, 1.0), "unit_return": (2, 1.0), "final_distance": (1, 1000.0)}
NAMES = {
    "success_rate": "Success, any step",
    "final_success_rate": "Success, last step",
    "mean_return": "Mean return",
    "final_distance": "Distance at the last step (mm)",
    "deterministic_success_rate": "Success, any step, mean action",
    "deterministic_final_success_rate": "Success, last step, mean action",
    "deterministic_mean_return": "Mean return, mean action",
    "deterministic_final_distance": "Distance at the last step, mean action (mm)",
    "unit_return": "Mean return at control weight 1",
    "area_under_curve": "Mean return while training",
    "steps_to_threshold": "Steps to the threshold (thousands)",
}
PAIRS = {
    ("alpha0", "mean_return"): "r(α₀, return)",
    ("success_rate", "mean_return"): "r(success, return)",
    ("success_rate", "budget"): "r(success, budget)",
}
DASH = "\N{EN DASH}"


@dataclass(frozen=True)
class Section:
    """One experiment: anchor, title, introduction, sentences, tables by caption, and names of its figures."""

    name: str
    title: str
    intro: str
    sentences: list[str]
    grids: dict[str, Grid]
    figures: list[str]


def read(paths: Iterable[str]) -> dict[str, dict[str, pd.DataFrame]]:
    """The tables of experiments by experiment and name, from their files. Raises ArtifactError."""
    found: dict[str, dict[str, pd.DataFrame]] = {}
    for path in map(Path, paths):
        found.setdefault(path.parent.name, {})[path.stem] = artifacts.read_table(path, SCHEMAS[path.stem])
    return found


def section(
    name: str, given: Mapping[str, pd.DataFrame], figures: Iterable[str], training_logs: pd.DataFrame | None
) -> Section:
    """What the report says of one experiment, from its tables and the names of all figures."""
    said, found = [], {}
    if "effects" in given:
        said.append(effects_sentence(given["effects"]))
        found["What each switch does, mean over seeds [95 % interval]; p is Holm-corrected over a column"] = (
            effects_grid(given["effects"])
        )
    if given["cells"]["alpha0"].nunique() > 1:
        said.append(correlation_sentence(given["correlation"]))
        found["Pearson's correlation over cells [95 % bootstrap interval], and its range over studies of one seed"] = (
            correlation_grid(given["correlation"])
        )
    if any(name.startswith("released") for name in given["logs"]["protocol"]):
        found[
            "What is logged while training, mean over seeds [least, greatest]: the moving average over 20 iterations; "
            "the last column is the standard deviation of the torques at the end. Published runs of the same cells "
            "below"
        ] = logs_grid(given["logs"], training_logs)
    if "agreement" in given:
        said.append(agreement_sentence(given["agreement"]))
        found["Beside Stable-Baselines3 with the same settings: means, and Welch's interval of the difference"] = (
            agreement_grid(given["agreement"])
        )
    shaped = given["comparisons"][given["comparisons"]["family"] == "none"]
    if "effects" not in given and len(shaped):
        said.append(shaping_sentence(shaped))
        found["Paired differences to none: mean over seeds [95 % interval]; bold p would be below 0.05"] = shaping_grid(
            shaped
        )
    found["Every cell, mean over seeds [95 % interval]"] = cells_grid(given["cells"])
    title = TITLES.get(name, protocol_label(name).capitalize())
    shown = [figure for figure in figures if figure.startswith(f"{name}_")]
    return Section(name, title, INTROS.get(name, ""), [text for text in said if text], found, shown)


def to_markdown(section: Section) -> str:
    """The section's words and tables for a notebook."""
    parts = [f"## {section.title}", section.intro, *section.sentences]
    parts += [f"{caption}:\n\n{grids.to_markdown(grid)}" for caption, grid in section.grids.items()]
    return "\n\n".join(part for part in parts if part)


def _interval(row: Mapping[Any, Any], name: str, low: str, high: str, digits: int, factor: float = 1.0) -> str:
    """A number with its limits, from three columns of a row."""
    if pd.isna(row[name]):
        return DASH
    text = number(factor * row[name], digits)
    if pd.isna(row[low]):
        return text
    return f"{text} [{number(factor * row[low], digits)}, {number(factor * row[high], digits)}]"


def _p(value: float) -> str:
    return DASH if pd.isna(value) else "< 0.001" if value < 0.001 else number(value, 3)


def effects_grid(effects: pd.DataFrame) -> Grid:
    """A row per switch, variant and kind of effect; for each measure the difference and its corrected p."""
    rows = []
    kinds = {**KINDS, "interaction": "last less alone"}
    for (switch, variant, kind), own in effects.groupby(["switch", "variant", "effect"], sort=False):
        by_metric = {str(row["metric"]): row for row in own.to_dict("records")}
        first = next(iter(by_metric.values()))
        entries = [switch_label(first), variant_label(str(variant)), kinds[str(kind)]]
        for metric, (digits, factor) in METRICS.items():
            row = by_metric[metric]
            entries += [_interval(row, "difference", "ci_low", "ci_high", digits, factor), _p(row["p_holm"])]
        rows.append((list(dict.fromkeys(effects["switch"])).index(switch), entries))
    headings = ["Switch", "Variant", "Effect"]
    headings += [text for metric in METRICS for text in (NAMES[metric], "p")]
    return Grid(headings, [entries for _, entries in sorted(rows, key=lambda row: row[0])], frozenset({0, 1, 2}))


def effects_sentence(effects: pd.DataFrame) -> str:
    """Which switch moves each measure most, and where switches interact beyond chance."""
    parts = []
    for metric, (digits, factor) in METRICS.items():
        single = effects[(effects["metric"] == metric) & effects["effect"].isin(["alone", "last"])]
        single = single.dropna(subset="difference")
        if single.empty:
            continue
        row = single.iloc[int(single["difference"].abs().to_numpy().argmax())].to_dict()
        parts.append(
            f"{NAMES[metric][0].lower()}{NAMES[metric][1:]}: {switch_label(row)} "
            f"({variant_label(row['variant'])}, {KINDS[row['effect']]}), "
            f"{_interval(row, 'difference', 'ci_low', 'ci_high', digits, factor)}"
        )
    text = f"The largest effect of one switch on each measure: {'; '.join(parts)}." if parts else ""
    found = effects[(effects["effect"] == "interaction") & (effects["p_holm"] < LEVEL)]
    if not (effects["effect"] == "interaction").any():
        return text
    names = dict.fromkeys(
        f"{protocol_label(row['switch'])} on {NAMES[row['metric']][0].lower()}{NAMES[row['metric']][1:]} "
        f"({variant_label(row['variant'])})"
        for row in found[found["metric"].isin(list(METRICS))].to_dict("records")
    )
    if not names:
        return f"{text} No switch's effect depends on the others beyond chance."
    return f"{text} What a switch does depends on the others beyond chance for {', '.join(names)}."


def correlation_grid(correlation: pd.DataFrame) -> Grid:
    """A row per pair of the paper: published, over our cells without and with the labelled baseline, single seeds."""
    rows = []
    for (x, y), name in PAIRS.items():
        own = correlation[(correlation["method"] == "pearson") & (correlation["x"] == x) & (correlation["y"] == y)]
        by_level = {row["level"]: row for row in own.to_dict("records")}
        seeds = own[own["level"].str.startswith("seed")]["r"].dropna()
        span = f"{number(seeds.min(), 2)} to {number(seeds.max(), 2)}" if len(seeds) else DASH
        texts = [
            _interval(by_level[level], "r", "ci_low", "ci_high", 2) if level in by_level else DASH
            for level in ("published", "cells", "cells_all")
        ]
        rows.append([name, *texts, span])
    headings = ["", "Published", "Over our cells", "with the run left out of the tables", "One seed a cell, range"]
    return Grid(headings, rows)


def correlation_sentence(correlation: pd.DataFrame) -> str:
    """The paper's strongest correlation beside ours."""
    own = correlation[(correlation["method"] == "pearson") & (correlation["x"] == "alpha0")]
    by_level = {row["level"]: row for row in own[own["y"] == "mean_return"].to_dict("records")}
    theirs, ours = (_interval(by_level[level], "r", "ci_low", "ci_high", 2) for level in ("published", "cells"))
    return (
        f"With the published labels, the start weight and the mean return of these cells correlate at {ours}; "
        f"published {theirs}. No run behind it has a start weight other than 1."
    )


def logs_grid(logs: pd.DataFrame, training_logs: pd.DataFrame | None) -> Grid:
    """A row per cell whose own log is the released one, and a row per published log."""

    def span(values: "pd.Series[float]", digits: int) -> str:
        low, mean, high = (number(value, digits) for value in (values.min(), values.mean(), values.max()))
        return f"{mean} [{low}, {high}]"

    rows = []
    groups = logs.groupby(["protocol", "variant", "budget", "alpha0"], sort=False)
    ordered = sorted(groups, key=lambda group: (group[1]["protocol"].iloc[0], cell_order(group[1].iloc[0].to_dict())))
    for _, own in ordered:
        cell = own.iloc[0].to_dict()
        texts = [span(own[name], digits) for name, digits in LOGGED.items()]
        texts.append(span(own["action_std"], 2))
        setting = setting_label(int(cell["budget"]), cell["alpha0"])
        rows.append([protocol_label(cell["protocol"]), variant_label(cell["variant"]), setting, *texts])
    for run in training_logs.to_dict("records") if training_logs is not None else ():
        texts = [number(run[name], digits) for name, digits in LOGGED.items()]
        setting = budget_label(int(run["budget"]))
        std = f"{number(run['std_1'], 2)} and {number(run['std_2'], 2)}"
        rows.append([f"published, {run['run']}", variant_label(str(run["variant"])), setting, *texts, std])
    headings = ["Protocol", "Variant", "Budget, label", "Iteration of the peak", "Peak", "End", "Deviation at the end"]
    return Grid(headings, rows, frozenset({0, 1, 2}))


LOGGED = {"peak_iteration": 0, "peak_return": 1, "final_return": 1}


def agreement_grid(agreement: pd.DataFrame) -> Grid:
    """A row per measure: ours, theirs, the difference with its interval, p."""
    rows = []
    for row in agreement.to_dict("records"):
        digits, factor = (1, 1000.0) if row["metric"].endswith("distance") else (3, 1.0)
        means = [number(factor * row[name], digits) for name in ("ours", "theirs")]
        difference = _interval(row, "difference", "ci_low", "ci_high", digits, factor)
        rows.append([NAMES[row["metric"]], *means, difference, _p(row["p"]), _p(row["p_holm"])])
    return Grid(["Measure", "Ours", "Stable-Baselines3", "Difference", "p (Welch)", "p (Holm)"], rows)


def agreement_sentence(agreement: pd.DataFrame) -> str:
    """Whether the two implementations differ beyond chance."""
    apart = agreement[agreement["p_holm"] < LEVEL]
    seeds = f"{agreement['our_seeds'].max():.0f} seeds beside {agreement['their_seeds'].max():.0f}"
    if apart.empty:
        return f"None of {len(agreement)} measures differs from Stable-Baselines3's beyond chance ({seeds})."
    names = ", ".join(NAMES[name].lower() for name in apart["metric"])
    return (
        f"{len(apart)} of {len(agreement)} measures differ from Stable-Baselines3's beyond chance ({seeds}): {names}."
    )


SHAPING = ("success_rate", "final_success_rate", "mean_return", "final_distance", "area_under_curve")


def shaping_grid(shaped: pd.DataFrame) -> Grid:
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
            digits, factor = (1, 1000.0) if metric.endswith("distance") else (3, 1.0)
            entries.append(_interval(own[metric], "difference", "ci_low", "ci_high", digits, factor))
            entries.append(_p(own[metric]["p_holm"]))
        rows.append(entries)
    headings = ["Protocol", "Variant", "Budget, α₀", *(text for name in SHAPING for text in (NAMES[name], "p"))]
    return Grid(headings, rows, frozenset({0, 1, 2}))


def shaping_sentence(shaped: pd.DataFrame) -> str:
    """In how many comparisons a shaped cell differs from `none` beyond chance, measure by measure."""
    parts = []
    for metric in SHAPING:
        own = shaped[shaped["metric"] == metric].dropna(subset="p_holm")
        apart = own[own["p_holm"] < LEVEL]
        better = (apart["difference"] < 0).sum() if metric.endswith("distance") else (apart["difference"] > 0).sum()
        parts.append(
            f"{NAMES[metric][0].lower()}{NAMES[metric][1:]} in {len(apart)} of {len(own)}"
            + (f" ({better} for the better)" if len(apart) else "")
        )
    return f"Shaped cells that differ from none beyond chance (Holm, 5 %): {', '.join(parts)}."


def cells_grid(cells: pd.DataFrame) -> Grid:
    """Every cell with the measures of the study's tables, protocol by protocol."""
    order = list(dict.fromkeys(cells["protocol"]))
    rows = sorted(cells.to_dict("records"), key=lambda row: (order.index(row["protocol"]), *cell_order(row)))
    frame = pd.DataFrame(rows, columns=cells.columns)
    frame["policy"] = [protocol_label(name) for name in frame["protocol"]]
    keep = ["policy", "variant", "budget", "alpha0", "seeds", "diverged"]
    keep += [f"{name}{end}" for name in tables.MEASURED for end in ("", "_low", "_high")]
    grid = of_table(frame[keep])
    return Grid(["Protocol", *grid.headings[1:]], grid.rows, grid.texts)
