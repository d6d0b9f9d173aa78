"""Figures the paper does not have. Tables in, matplotlib figures out; no statistic is computed here."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
import seaborn.objects as so
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reacher_shaping.analysis.baselines import ALGORITHMS, peer_table
from reacher_shaping.figures import parts
from reacher_shaping.figures.style import (
    QUIET,
    empty_figure,
    look,
    millimetres,
    percent,
    variant_color,
    variant_legend,
    variant_look,
)
from reacher_shaping.labels import CELL, budget_label, cell_order, of_protocol, setting_label, variant_label

AXIS_LABELS = {
    "success_rate": "Success rate: within the radius at any step",
    "final_success_rate": "Success rate at the last step",
    "mean_return": "Mean episode return",
    "final_distance": "Distance at the last step (mm)",
}
ALGORITHM_COLORS = {"ppo": "#56B4E9", "sac": "#882255", "td3": "#999933"}


@look()
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
    ours = _named(of_protocol(cells, protocol))
    if ours.empty:
        return empty_figure()
    names = ours[[*CELL, "row"]]
    runs = of_protocol(runs, protocol).merge(names, on=CELL).assign(color=lambda frame: frame["variant"])
    if published is not None and metric in published:
        published = published[[*CELL, metric]].merge(names, on=CELL)
    label = AXIS_LABELS.get(metric, metric.replace("_", " "))
    colors = parts.looks(ours["variant"])["color"]
    figure = parts.strip(runs, ours, {metric: label}, colors, published)
    parts.shade(figure.axes[0], list(ours["variant"]))
    return figure


def _named(cells: pd.DataFrame) -> pd.DataFrame:
    """Cells in their order, each with the name of its row."""
    rows = sorted(cells.to_dict("records"), key=cell_order)
    return pd.DataFrame([row | {"row": parts.cell_name(row)} for row in rows], columns=[*cells.columns, "row"])


@look()
def peers(
    peers: pd.DataFrame,
    runs: pd.DataFrame,
    cells: pd.DataFrame,
    controllers: pd.DataFrame | None = None,
    protocol: str | None = None,
) -> Figure:
    """A row per row of `peer_table`, a dot per seed, a bar at the mean: success rate left, return right."""
    if peers.empty:
        return empty_figure()
    none = of_protocol(runs, protocol)
    none = none[none["variant"] == "none"].assign(policy="none (this study)", color="none")
    theirs = peers.assign(policy=peers["algorithm"].replace(ALGORITHMS), color=peers["algorithm"])
    points = pd.concat([theirs, none], ignore_index=True)
    table = peer_table(peers, cells, controllers, protocol)
    measures = {name: AXIS_LABELS[name] for name in ("success_rate", "mean_return")}
    colors = {name: ALGORITHM_COLORS.get(name, variant_color(name)) for name in points["color"].unique()}
    points, table = (
        frame.assign(row=[_peer_name(row) for row in frame.to_dict("records")]) for frame in (points, table)
    )
    figure = parts.strip(points, table, measures, colors, width=9.0)
    figure.axes[0].set_xlim(left=-0.03)
    return figure


def _peer_name(row: Mapping[Any, Any]) -> str:
    return str(row["policy"]) + (f" · {budget_label(int(row['budget']))}" if pd.notna(row["budget"]) else "")


@look()
def forest(
    comparisons: pd.DataFrame, family: str = "none", metric: str = "success_rate", protocol: str | None = None
) -> Figure:
    """A row per paired comparison of a family: difference, interval, Holm-corrected p; filled where zero is left out.

    `comparisons` as `comparisons.comparison_frame` gives it: `family, metric`, the cell's key, `other_variant,
    other_budget, other_alpha0, difference, ci_low, ci_high, p_holm`.
    """
    ours = _family(comparisons, family, metric, protocol)
    if ours.empty:
        return empty_figure()
    figure, axes = _rows_of_differences(ours, 0.0)
    for y, p in enumerate(ours["p_holm"]):
        if np.isfinite(p):
            parts.write_beside(axes, y, f"{p:.3f}" if p >= 0.001 else "< 0.001")
    parts.write_beside(axes, -1, "p (Holm)")
    label = f"Paired difference in {metric.replace('_', ' ')}"
    if metric.endswith("rate"):
        percent(axes.xaxis, symbol="")
        label += ", percentage points"
    elif metric.endswith("distance"):
        millimetres(axes.xaxis)
        label += ", mm"
    others = {_partner(row) for row in ours.to_dict("records")}
    shared = others.pop() if len(others) == 1 else ""
    axes.set_xlabel(f"{label}: less {shared}, same seeds" if shared else label)
    return figure


@look()
def improvement(
    comparisons: pd.DataFrame, family: str = "none", metric: str = "success_rate", protocol: str | None = None
) -> Figure:
    """Probability of improvement (Agarwal et al. 2021): that a run of the row's cell beats one of its partner's.

    `comparisons` as `comparisons.comparison_frame` gives it, with `improvement, improvement_low, improvement_high`.
    """
    ours = _family(comparisons, family, metric, protocol)
    if ours.empty:
        return empty_figure()
    ours = ours.assign(difference=ours["improvement"], ci_low=ours["improvement_low"], ci_high=ours["improvement_high"])
    figure, axes = _rows_of_differences(ours, 0.5)
    axes.set_xlim(-0.02, 1.02)
    percent(axes.xaxis)
    others = {_partner(row) for row in ours.to_dict("records")}
    axes.set_xlabel(
        f"Probability that a run has the higher {metric.replace('_', ' ')} than one of {others.pop()}"
        if len(others) == 1
        else f"Probability of the higher {metric.replace('_', ' ')}"
    )
    return figure


def _family(comparisons: pd.DataFrame, family: str, metric: str, protocol: str | None) -> pd.DataFrame:
    """The comparisons of one family and measure in the order of their cells, each with the name of its row."""
    ours = of_protocol(comparisons, protocol)
    ours = _named(ours[(ours["family"] == family) & (ours["metric"] == metric)].dropna(subset="difference"))
    others = [_partner(row) for row in ours.to_dict("records")]
    if len(set(others)) > 1:  # else the partner is said once, under the axis
        ours["row"] = [f"{name}  less  {other}" for name, other in zip(ours["row"], others, strict=True)]
    return ours


def _rows_of_differences(ours: pd.DataFrame, zero: float) -> tuple[Figure, Axes]:
    """A figure with one panel: a row per comparison."""
    figure = Figure(figsize=(7.8, 1.2 + parts.ROW * max(len(ours), 4)))
    clear = (ours["ci_low"] > zero) | (ours["ci_high"] < zero)
    plot = so.Plot(ours.assign(clear=clear), y="row", color="variant")
    scales = {"y": so.Nominal(order=list(ours["row"])), "color": parts.looks(ours["variant"])["color"]}
    (axes,) = parts.draw(parts.with_intervals(plot).scale(**scales), figure)
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(len(ours) - 0.4, -0.6)
    parts.shade(axes, list(ours["variant"]))
    parts.zero_line(axes, zero)
    return figure, axes


def _partner(row: Mapping[Any, Any]) -> str:
    """The second cell of a comparison, by what is different in it; `none` has no weight of its own."""
    named = []
    if row["other_variant"] != row["variant"]:
        named.append(variant_label(row["other_variant"]))
    elif row["other_alpha0"] != row["alpha0"]:
        named.append(f"α₀ = {row['other_alpha0']:g}")
    if row["other_budget"] != row["budget"]:
        named.append(budget_label(row["other_budget"]))
    return " · ".join(named)


@look()
def success_by_radius(
    radii: pd.DataFrame, protocol: str | None = None, radius: float | None = None, mode: str = "stochastic"
) -> Figure:
    """Success against the radius that counts as success, a panel per budget and alpha0.

    `radii` as `runs.radius_cells` gives it: the cell's key, `mode, radius` (m), `success_rate` with `_low` and
    `_high`. A dotted line stands at `radius`, the study's own.
    """
    part = of_protocol(radii, protocol)
    part = part[part["mode"] == mode] if "mode" in part else part
    figure = _lines_by_setting(part, "radius", "success_rate", "Radius (mm)", "Success rate")
    for axes in figure.axes if len(part) else []:
        millimetres(axes.xaxis)
        if radius is not None and axes.lines:
            axes.axvline(radius, color=QUIET, linestyle=":", linewidth=1.1, label="_radius")
    return figure


@look()
def long_episodes(lengths: pd.DataFrame, protocol: str | None = None, metric: str = "final_distance") -> Figure:
    """A measure against episode length, a panel per budget and alpha0.

    `lengths`: the cell's key, `steps` (episode length), `metric` with `_low` and `_high`.
    """
    label = AXIS_LABELS.get(metric, metric.replace("_", " "))
    return _lines_by_setting(of_protocol(lengths, protocol), "steps", metric, "Steps per episode", label)


def _lines_by_setting(frame: pd.DataFrame, x: str, y: str, x_label: str, y_label: str) -> Figure:
    """A line per variant with a band, a panel per budget and alpha0, two panels a row where there are many.

    Where a setting has no unshaped cell, that of the same budget is drawn in, dashed.
    """
    if frame.empty:
        return empty_figure()
    named, titles = parts.by_setting(frame, lambda _, budget, alpha0: setting_label(budget, alpha0))
    columns = len(titles) if len(titles) <= 3 else 2
    figure = Figure(figsize=(3.3 * columns + 1.7, 3.0 * -(-len(titles) // columns) + 0.2))
    facets = {"col": "panel", "order": titles, "wrap": columns}
    banded = named.assign(low=named[f"{y}_low"].where(~named["borrowed"]), high=named[f"{y}_high"])
    panels = parts.lines(figure, banded, x, y, facets, {"x": True, "y": True}, marked=True)
    for axes in panels:
        if y.endswith("rate"):
            percent(axes.yaxis)
        elif y.endswith("distance"):
            millimetres(axes.yaxis)
    figure.supxlabel(x_label, fontsize=9)
    figure.supylabel(y_label, fontsize=9)
    variant_legend(figure, list(frame["variant"]), marked=True)
    return figure


@look()
def lottery(lottery: pd.DataFrame) -> Figure:
    """How often each statement comes out when a study has one seed per cell: a bar per statement.

    `lottery` as `single_seed_studies.lottery_frame` gives it: `statement`, `share` (0 to 1).
    """
    frame = lottery.dropna(subset="share")
    if frame.empty:
        return empty_figure()
    names = [" ".join(map(variant_label, str(words).replace("`", "").split())) for words in frame["statement"]]
    names = [name.replace("alpha0", "α₀") for name in names]
    figure = Figure(figsize=(7.5, 1.0 + 0.3 * max(len(frame), 3)))
    shown = frame.assign(statement=names, text=[f"{100 * share:.1f} %" for share in frame["share"]])
    plot = so.Plot(shown, x="share", y="statement", text="text").add(so.Bar(color="#0072B2", alpha=1, width=0.65))
    (axes,) = parts.draw(plot.add(so.Text(color="black", fontsize=8, halign="left", offset=4)), figure)
    axes.tick_params(axis="y", length=0)
    axes.set(xlim=(0, 1.15), xlabel="Share of single-seed studies in which it comes out", ylabel="")
    percent(axes.xaxis)
    return figure


KIND_NAMES = {"none": "none", "constant": "constant", "decay": "decay", "decay_l2sq": "decay, L2²"}
KIND_LOOKS = {"none": "none", "constant": "l2", "decay": "decay300k", "decay_l2sq": "decay300k_l2sq"}
"""The variant whose look stands for a kind."""


@look()
def profiles(profiles: pd.DataFrame, protocol: str | None = None) -> Figure:
    """A panel per budget, a line per kind of variants: the share of runs whose success is above a threshold."""
    ours = of_protocol(profiles, protocol)
    if ours.empty:
        return empty_figure()
    budgets = sorted(ours["budget"].unique())
    figure = Figure(figsize=(3.6 * len(budgets) + 0.6, 3.2))
    panels = np.atleast_1d(figure.subplots(1, len(budgets), sharey=True))
    for axes, budget in zip(panels, budgets, strict=True):
        for kind, variant in KIND_LOOKS.items():
            own = ours[(ours["budget"] == budget) & (ours["kind"] == kind)].sort_values("threshold")
            if own.empty:
                continue
            drawn = variant_look(variant)
            line = {"color": drawn.color, "dashes": drawn.dashes, "label": KIND_NAMES[kind]}
            axes.plot(own["threshold"], own["share"], drawstyle="steps-post", **line)
            edges = {"step": "post", "color": drawn.color, "alpha": 0.14, "linewidth": 0}
            axes.fill_between(own["threshold"], own["share_low"], own["share_high"], **edges)
        axes.set_title(budget_label(int(budget)))
        axes.set_xlabel("Success rate")
        percent(axes.xaxis)
        percent(axes.yaxis)
    panels[0].set_ylabel("Share of runs above it")
    panels[-1].legend(loc="upper right")
    return figure
