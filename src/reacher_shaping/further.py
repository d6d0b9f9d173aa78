"""Figures the paper does not have. Tables in, matplotlib figures out; no statistic is computed here."""

from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import PercentFormatter

from reacher_shaping.bars import PUBLISHED
from reacher_shaping.style import (
    STYLE,
    budget_label,
    empty_panel,
    of_protocol,
    setting_label,
    settings_of,
    variant_color,
    variant_label,
    variant_order,
)

CELL = ["variant", "budget", "alpha0"]
AXIS_LABELS = {
    "success_rate": "Success rate: within the radius at any step",
    "final_success_rate": "Success rate at the last step",
    "mean_return": "Mean episode return",
    "final_distance": "Distance at the last step (m)",
}


@mpl.rc_context(STYLE)
def seed_strip(
    runs: pd.DataFrame,
    cells: pd.DataFrame,
    published: pd.DataFrame | None = None,
    metric: str = "success_rate",
    protocol: str | None = None,
) -> Figure:
    """A row per cell: a dot per run, a bar at the mean with its interval, a diamond where the paper has a value.

    `runs` and `cells` as in the study's tables; `metric` is one of their measures; `published` comes from
    `tables.published_cells`.
    """
    ours = of_protocol(cells, protocol)
    figure = Figure(figsize=(7.5, 1.3 + 0.27 * max(len(ours), 4)))
    axes = figure.subplots()
    if ours.empty:
        empty_panel(axes, "not in this study")
        return figure
    values = of_protocol(runs, protocol).groupby(CELL)[metric]
    theirs = {} if published is None or metric not in published else published.set_index(CELL)[metric].to_dict()
    rows = sorted(ours.to_dict("records"), key=_row_order)
    for y, row in enumerate(rows):
        key = (row["variant"], row["budget"], row["alpha0"])
        color = variant_color(row["variant"])
        dots = values.get_group(key).to_numpy()
        axes.plot(dots, np.full(len(dots), y), "o", color=color, markersize=4.5, alpha=0.55, mew=0, label="_runs")
        axes.plot([row[f"{metric}_low"], row[f"{metric}_high"]], [y, y], color="black", lw=1.4, label="_interval")
        axes.plot(row[metric], y, "|", color="black", markersize=11, markeredgewidth=2, label="_mean")
        if key in theirs:
            axes.plot(theirs[key], y, linestyle="none", label="_published", zorder=4, **PUBLISHED)
    names = [f"{variant_label(row['variant'])} · {setting_label(row['budget'], row['alpha0'])}" for row in rows]
    _name_rows(axes, names)
    if metric.endswith("rate"):
        axes.xaxis.set_major_formatter(PercentFormatter(xmax=1, decimals=0, symbol=" %"))
    axes.set_xlabel(AXIS_LABELS.get(metric, metric.replace("_", " ")))
    handles = [
        Line2D([], [], marker="o", color="#777777", linestyle="none", markersize=4.5, label="one seed"),
        Line2D([], [], marker="|", color="black", markersize=9, markeredgewidth=2, label="mean and interval"),
        Line2D([], [], linestyle="none", label="published (one run)", **PUBLISHED),
    ]
    figure.legend(handles=handles if theirs else handles[:2], loc="outside lower center", ncols=3)
    return figure


def _name_rows(axes: Axes, names: list[str]) -> None:
    """Rows from top to bottom, each with its name."""
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")


@mpl.rc_context(STYLE)
def forest(
    comparisons: pd.DataFrame, family: str = "none", metric: str = "success_rate", protocol: str | None = None
) -> Figure:
    """A row per paired comparison of a family: difference, interval, Holm-corrected p; filled where zero is left out.

    `comparisons` as `comparisons.comparison_frame` gives it: `family, metric`, the cell's key, `other_variant,
    other_budget, other_alpha0, difference, ci_low, ci_high, p_holm`.
    """
    ours = of_protocol(comparisons, protocol)
    ours = ours[(ours["family"] == family) & (ours["metric"] == metric)].dropna(subset="difference")
    figure = Figure(figsize=(7.8, 1.2 + 0.27 * max(len(ours), 4)))
    axes = figure.subplots()
    if ours.empty:
        empty_panel(axes, "not in this study")
        return figure
    rows = sorted(ours.to_dict("records"), key=_row_order)
    axes.axvline(0, color="#555555", linewidth=1, linestyle="--", label="_zero")
    for y, row in enumerate(rows):
        color = variant_color(row["variant"])
        clear = row["ci_low"] > 0 or row["ci_high"] < 0
        axes.plot([row["ci_low"], row["ci_high"]], [y, y], color=color, linewidth=1.6, label="_interval")
        face = color if clear else "white"
        axes.plot(row["difference"], y, "o", color=color, markerfacecolor=face, markersize=5.5, label="_difference")
        if np.isfinite(row["p_holm"]):
            text = f"p = {row['p_holm']:.3f}" if row["p_holm"] >= 0.001 else "p < 0.001"
            axes.annotate(
                text, (1, y), xycoords=("axes fraction", "data"), xytext=(5, 0), textcoords="offset points",
                va="center", fontsize=8, color="#444444", annotation_clip=False,
            )  # fmt: skip
    _name_rows(axes, [_comparison(row) for row in rows])
    axes.set_xlabel(f"Paired difference in {metric.replace('_', ' ')}")
    return figure


def _row_order(row: dict[Any, Any]) -> tuple[Any, ...]:
    """Rows by variant, full alpha0 first, then by budget."""
    return variant_order(row["variant"]), -row["alpha0"], row["budget"]


def _comparison(row: dict[Any, Any]) -> str:
    """Both cells of a comparison; of the second only what differs."""
    ours = f"{variant_label(row['variant'])} · {setting_label(row['budget'], row['alpha0'])}"
    parts = []
    if row["other_variant"] != row["variant"]:
        parts.append(variant_label(row["other_variant"]))
    elif row["other_alpha0"] != row["alpha0"]:
        parts.append(f"α₀ = {row['other_alpha0']:g}")
    if row["other_budget"] != row["budget"]:
        parts.append(budget_label(row["other_budget"]))
    return f"{ours}  less  {' · '.join(parts)}"


@mpl.rc_context(STYLE)
def success_by_radius(
    radii: pd.DataFrame, protocol: str | None = None, radius: float | None = None, mode: str = "stochastic"
) -> Figure:
    """Success against the radius that counts as success, a panel per budget and alpha0.

    `radii` as `aggregate.radius_cells` gives it: the cell's key, `mode, radius` (m), `success_rate` with `_low` and
    `_high`. A dotted line stands at `radius`, the study's own.
    """
    part = of_protocol(radii, protocol)
    part = part[part["mode"] == mode] if "mode" in part else part
    figure = _lines_by_setting(part, "radius", "success_rate", "Radius (mm)", "Success rate", 1000)
    for axes in figure.axes if radius is not None else []:
        axes.axvline(1000 * float(radius or 0), color="#555555", linestyle=":", linewidth=1.1, label="_radius")
    return figure


@mpl.rc_context(STYLE)
def long_episodes(frame: pd.DataFrame, protocol: str | None = None, metric: str = "final_success_rate") -> Figure:
    """A measure against episode length, a panel per budget and alpha0.

    `frame`: the cell's key, `steps` (episode length), `metric` with `_low` and `_high`.
    """
    label = AXIS_LABELS.get(metric, metric.replace("_", " "))
    return _lines_by_setting(of_protocol(frame, protocol), "steps", metric, "Steps per episode", label, 1)


def _lines_by_setting(frame: pd.DataFrame, x: str, y: str, x_label: str, y_label: str, scale: float) -> Figure:
    """A line per variant with a band, a panel per budget and alpha0."""
    settings = settings_of(frame)
    figure = Figure(figsize=(2.9 * max(len(settings), 1) + 1.6, 3.3))
    panels = figure.subplots(1, max(len(settings), 1), sharey=True, squeeze=False)[0]
    if not settings:
        empty_panel(panels[0], "not in this study")
        return figure
    handles: dict[str, Line2D] = {}
    for axes, (budget, alpha0) in zip(panels, settings, strict=True):
        axes.set_title(setting_label(budget, alpha0))
        axes.set_xlabel(x_label)
        here = frame[(frame["budget"] == budget) & (frame["alpha0"] == alpha0)]
        for variant in sorted(here["variant"].unique(), key=variant_order):
            line = here[here["variant"] == variant].sort_values(x)
            places, color = line[x].to_numpy() * scale, variant_color(variant)
            low, high = line[f"{y}_low"].to_numpy(), line[f"{y}_high"].to_numpy()
            axes.fill_between(places, low, high, color=color, alpha=0.08, linewidth=0)
            (handles[variant_label(variant)],) = axes.plot(
                places, line[y].to_numpy(), color=color, marker=".", label=variant_label(variant)
            )
    if y.endswith("rate"):
        panels[0].yaxis.set_major_formatter(PercentFormatter(xmax=1, decimals=0, symbol=" %"))
    panels[0].set_ylabel(y_label)
    panels[-1].legend(list(handles.values()), list(handles), loc="center left", bbox_to_anchor=(1.02, 0.5))
    return figure


@mpl.rc_context(STYLE)
def lottery(frame: pd.DataFrame) -> Figure:
    """How often each statement comes out when a study has one seed per cell: a bar per statement.

    `frame` as `lottery.lottery_frame` gives it: `statement`, `share` (0 to 1).
    """
    frame = frame.dropna(subset="share")
    figure = Figure(figsize=(7.5, 1.0 + 0.3 * max(len(frame), 3)))
    axes = figure.subplots()
    if frame.empty:
        empty_panel(axes, "not in this study")
        return figure
    bars = axes.barh(range(len(frame)), frame["share"], color="#0072B2", height=0.65)
    labels = [f"{100 * share:.1f} %" for share in frame["share"]]
    axes.bar_label(bars, labels, padding=4, fontsize=8)
    _name_rows(axes, [str(statement) for statement in frame["statement"]])
    axes.set_xlim(0, 1.08)
    axes.xaxis.set_major_formatter(PercentFormatter(xmax=1, decimals=0, symbol=" %"))
    axes.set_xlabel("Share of single-seed studies in which it comes out")
    return figure
