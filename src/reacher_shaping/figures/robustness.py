"""Figures the paper does not have. Tables in, matplotlib figures out; no statistic is computed here."""

from collections.abc import Mapping
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import PercentFormatter

from reacher_shaping.figures.bars import PUBLISHED
from reacher_shaping.figures.style import STYLE, empty_panel, variant_color
from reacher_shaping.labels import (
    CELL,
    budget_label,
    cell_order,
    of_protocol,
    setting_label,
    settings_of,
    variant_label,
    variant_order,
)

DOT: dict[str, Any] = {
    "marker": "o",
    "linestyle": "none",
    "markersize": 5.5,
    "markeredgecolor": "white",
    "markeredgewidth": 0.6,
}
LOST_COLOR = "#B00020"
CROSS: dict[str, Any] = {
    "marker": "x",
    "linestyle": "none",
    "color": LOST_COLOR,
    "markersize": 6.5,
    "markeredgewidth": 1.8,
}
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
    `paper_tables.published_cells`. A run that diverged is a cross.
    """
    ours = of_protocol(cells, protocol)
    figure = Figure(figsize=(7.5, 1.3 + 0.27 * max(len(ours), 4)))
    axes = figure.subplots()
    if ours.empty:
        empty_panel(axes, "not in this study")
        return figure
    parts = of_protocol(runs, protocol).groupby(CELL)
    theirs = {} if published is None or metric not in published else published.set_index(CELL)[metric].to_dict()
    rows = sorted(ours.to_dict("records"), key=cell_order)
    for y, row in enumerate(rows):
        key = (row["variant"], row["budget"], row["alpha0"])
        draw_runs(axes, y, parts.get_group(key), row, metric, variant_color(row["variant"]))
        if key in theirs:
            axes.plot(theirs[key], y, linestyle="none", label="_published", zorder=4, **PUBLISHED)
    name_rows(axes, [_name(row) for row in rows])
    _shade_variants(axes, rows)
    if metric.endswith("rate"):
        axes.xaxis.set_major_formatter(PercentFormatter(xmax=1, decimals=0, symbol=" %"))
    axes.set_xlabel(AXIS_LABELS.get(metric, metric.replace("_", " ")))
    explain_runs(figure, published=bool(theirs))
    return figure


def draw_runs(axes: Axes, y: int, runs: pd.DataFrame, row: Mapping[Any, Any], metric: str, color: str) -> None:
    """Row `y` of a strip: a dot per run, and the mean and interval of `row`.

    A run that diverged is a cross at its value, or at the left edge where it has none.
    """
    interval = [row[f"{metric}_low"], row[f"{metric}_high"]]
    axes.plot(interval, [y, y], color="#555555", lw=1.2, label="_interval", zorder=2)
    axes.plot(row[metric], y, "|", color="black", markersize=12, markeredgewidth=2, label="_mean", zorder=2.5)
    values = runs[metric].to_numpy(dtype=float)
    lost = ~np.isfinite(values)
    diverged = runs["diverged"].to_numpy(dtype=bool) | lost if "diverged" in runs else lost
    dots, crosses = values[~diverged], values[diverged & ~lost]
    axes.plot(dots, np.full(len(dots), y), color=color, label="_runs", zorder=3, **DOT)
    if len(crosses):
        axes.plot(crosses, np.full(len(crosses), y), label="_diverged", zorder=3.5, **CROSS)
    if lost.any():
        edge = axes.get_yaxis_transform()  # x in parts of the axis, y in rows
        axes.plot(0.012, y, transform=edge, label="_diverged", zorder=3.5, **CROSS)
        if lost.sum() > 1:
            axes.text(0.027, y, f"{lost.sum()} runs", transform=edge, va="center", fontsize=8, color=LOST_COLOR)


def explain_runs(figure: Figure, published: bool = False) -> None:
    """A legend under a strip for what its panels show."""
    drawn = {line.get_label() for axes in figure.axes for line in axes.lines}
    handles = [
        Line2D([], [], color="#777777", label="one seed", **DOT),
        Line2D([], [], color="black", marker="|", markersize=9, markeredgewidth=2, lw=1.2, label="mean and interval"),
    ]
    if published:
        handles.append(Line2D([], [], linestyle="none", label="published (one run)", **PUBLISHED))
    if "_diverged" in drawn:
        handles.append(Line2D([], [], label="diverged", **CROSS))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))


def name_rows(axes: Axes, names: list[str]) -> None:
    """Rows from top to bottom, each with its name."""
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")


def _shade_variants(axes: Axes, rows: list[dict[Any, Any]]) -> None:
    """A light band behind every second variant, so that a row is found again at the other side."""
    variants = list(dict.fromkeys(row["variant"] for row in rows))
    for y, row in enumerate(rows):
        if variants.index(row["variant"]) % 2 == 0:
            axes.axhspan(y - 0.5, y + 0.5, color="#F3F5F7", linewidth=0, zorder=0)


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
    rows = sorted(ours.to_dict("records"), key=cell_order)
    _shade_variants(axes, rows)
    axes.axvline(0, color="#555555", linewidth=1, linestyle="--", label="_zero", zorder=1)
    for y, row in enumerate(rows):
        color = variant_color(row["variant"])
        clear = row["ci_low"] > 0 or row["ci_high"] < 0
        axes.plot([row["ci_low"], row["ci_high"]], [y, y], color=color, linewidth=1.6, label="_interval")
        face = color if clear else "white"
        axes.plot(row["difference"], y, "o", color=color, markerfacecolor=face, markersize=5.5, label="_difference")
        if np.isfinite(row["p_holm"]):
            _write_beside(axes, y, f"{row['p_holm']:.3f}" if row["p_holm"] >= 0.001 else "< 0.001")
    _write_beside(axes, -1, "p (Holm)")
    others = {_partner(row) for row in rows}
    shared = others.pop() if len(others) == 1 else None  # said once, under the axis
    name_rows(axes, [_name(row) + ("" if shared else f"  less  {_partner(row)}") for row in rows])
    label = f"Paired difference in {metric.replace('_', ' ')}"
    axes.set_xlabel(f"{label}: less {shared}, same seeds" if shared else label)
    return figure


def _write_beside(axes: Axes, y: float, text: str) -> None:
    """Text at the right of row `y`."""
    axes.annotate(
        text, (1, y), xycoords=("axes fraction", "data"), xytext=(5, 0), textcoords="offset points",
        va="center", fontsize=8, color="#444444", annotation_clip=False,
    )  # fmt: skip


def _name(row: dict[Any, Any]) -> str:
    return f"{variant_label(row['variant'])} · {setting_label(row['budget'], row['alpha0'])}"


def _partner(row: dict[Any, Any]) -> str:
    """The second cell of a comparison, by what is different in it; `none` has no weight of its own."""
    parts = []
    if row["other_variant"] != row["variant"]:
        parts.append(variant_label(row["other_variant"]))
    elif row["other_alpha0"] != row["alpha0"]:
        parts.append(f"α₀ = {row['other_alpha0']:g}")
    if row["other_budget"] != row["budget"]:
        parts.append(budget_label(row["other_budget"]))
    return " · ".join(parts)


@mpl.rc_context(STYLE)
def success_by_radius(
    radii: pd.DataFrame, protocol: str | None = None, radius: float | None = None, mode: str = "stochastic"
) -> Figure:
    """Success against the radius that counts as success, a panel per budget and alpha0.

    `radii` as `runs.radius_cells` gives it: the cell's key, `mode, radius` (m), `success_rate` with `_low` and
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
    """A line per variant with a band, a panel per budget and alpha0, two panels a row where there are many.

    Where a setting has no unshaped cell, that of the same budget is drawn in, dashed.
    """
    settings = settings_of(frame)
    if not settings:
        figure = Figure(figsize=(4.5, 3.3))
        empty_panel(figure.subplots(), "not in this study")
        return figure
    columns = len(settings) if len(settings) <= 3 else 2
    lines = -(-len(settings) // columns)
    figure = Figure(figsize=(3.3 * columns + 1.6, 3.0 * lines + 0.2))
    panels = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    handles: dict[str, Line2D] = {}
    for axes, (budget, alpha0) in zip(panels.flat, settings, strict=False):
        axes.set_title(setting_label(budget, alpha0))
        at_budget = frame[frame["budget"] == budget]
        here = at_budget[at_budget["alpha0"] == alpha0]
        borrowed = at_budget[(at_budget["variant"] == "none") & ("none" not in set(here["variant"]))]
        for variant, line in [*borrowed.groupby("variant"), *here.groupby("variant")]:
            handle = _draw_line(axes, line.sort_values(x), x, y, scale, dashed=line["alpha0"].iloc[0] != alpha0)
            handles.setdefault(str(variant), handle)
        if y.endswith("rate"):
            axes.yaxis.set_major_formatter(PercentFormatter(xmax=1, decimals=0, symbol=" %"))
    for axes in panels.flat[len(settings) :]:
        empty_panel(axes, "")
    figure.supxlabel(x_label, fontsize=9)
    figure.supylabel(y_label, fontsize=9)
    names = sorted(handles, key=variant_order)
    figure.legend(
        [handles[name] for name in names], [variant_label(name) for name in names], loc="outside right center"
    )
    return figure


def _draw_line(axes: Axes, line: pd.DataFrame, x: str, y: str, scale: float, dashed: bool) -> Line2D:
    """One variant's line with its band; dashed and without one where it stands in from another setting."""
    variant = str(line["variant"].iloc[0])
    places, color = line[x].to_numpy() * scale, variant_color(variant)
    low, high = line[f"{y}_low"].to_numpy(), line[f"{y}_high"].to_numpy()
    if not dashed:
        axes.fill_between(places, low, high, color=color, alpha=0.07, linewidth=0)
    style = "--" if dashed else "-"
    label = f"_{variant} of the same budget" if dashed else variant_label(variant)
    (drawn,) = axes.plot(places, line[y].to_numpy(), style, color=color, marker=".", label=label)
    return drawn


@mpl.rc_context(STYLE)
def lottery(frame: pd.DataFrame) -> Figure:
    """How often each statement comes out when a study has one seed per cell: a bar per statement.

    `frame` as `single_seed_studies.lottery_frame` gives it: `statement`, `share` (0 to 1).
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
    name_rows(axes, [str(statement).replace("`", "").replace("alpha0", "α₀") for statement in frame["statement"]])
    axes.set_xlim(0, 1.08)
    axes.xaxis.set_major_formatter(PercentFormatter(xmax=1, decimals=0, symbol=" %"))
    axes.set_xlabel("Share of single-seed studies in which it comes out")
    return figure
