"""Figures of the further studies. Tables in, matplotlib figures out; no statistic is computed here."""

import re
from collections.abc import Mapping
from typing import Any

import pandas as pd
import seaborn.objects as so
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from reacher_shaping.analysis.learning_curves import smoothed
from reacher_shaping.figures import paper, parts, robustness
from reacher_shaping.figures.style import (
    PUBLISHED,
    QUIET,
    empty_figure,
    look,
    millimetres,
    percent,
    variant_color,
    variant_legend,
    variant_line,
)
from reacher_shaping.labels import KEY, cell_order, setting_label, stochastic, variant_order
from reacher_shaping.settings.outputs import DOSES

STRIP = {
    "success_rate": "Success at any step",
    "final_success_rate": "Success at the last step",
    "mean_return": "Mean return",
}
EFFECT_LABELS = {
    "success_rate": "Change of: success rate at any step",
    "unit_return": "Change of: mean return at control weight 1",
    "final_distance": "Change of: distance at the last step (mm)",
}
WIDE = 150
"""Return beyond which an axis becomes logarithmic; ten times what a policy that reaches its target gets."""
KINDS = {"alone": "alone, from the start", "last": "as the last one, to the end", "all": "all together"}
MARKERS = {"alone": "o", "last": "s", "all": "D"}


def protocol_label(name: str) -> str:
    """`released_late_without_d1` as people read it."""
    return re.sub(r"\bd(\d)\b", r"D\1", name.replace("_", " "))


def switch_label(row: Mapping[Any, Any]) -> str:
    """A switch and, under it, what it sets; the setting alone where it bears the switch's name."""
    if row["switch"] == "all":
        return "all switches"
    name = protocol_label(str(row["switch"]))
    return str(row["setting"]) if str(row["setting"]).startswith(f"{name} ") else f"{name}: {row['setting']}"


@look()
def cells(runs: pd.DataFrame, cells: pd.DataFrame, controllers: pd.DataFrame | None = None) -> Figure:
    """A row per cell of all protocols, a panel per measure: a dot per run, a bar at the mean with its interval.

    A dotted line stands at the controller that solves the task, under the protocol of the row.
    """
    protocols = list(dict.fromkeys(runs["protocol"]))
    rows = sorted(cells.to_dict("records"), key=lambda row: (protocols.index(row["protocol"]), *cell_order(row)))
    named = pd.DataFrame(rows).assign(
        row=[f"{protocol_label(row['protocol'])} · {parts.cell_name(row)}" for row in rows]
    )
    points = runs.merge(named[[*KEY, "row"]]).assign(color=lambda frame: frame["variant"])
    figure = parts.strip(points, named, STRIP, parts.looks(named["variant"])["color"], width=11.0)
    ceilings = {protocol: _controller(controllers, protocol) for protocol in protocols}
    for axes, metric in zip(figure.axes, STRIP, strict=True):
        reached = [ceilings[row["protocol"]].get(metric) for row in rows]
        for y, value in enumerate(reached):
            if value is not None:
                axes.plot([value] * 2, [y - 0.5, y + 0.5], ":", color=QUIET, linewidth=1.2, label="_controller")
        shown = [*points[metric], *named[f"{metric}_low"], *named[f"{metric}_high"], *filter(None, reached)]
        compress(axes, pd.Series(shown, dtype=float))
        if len(protocols) > 1:
            parts.shade(axes, [row["protocol"] for row in rows])
    return figure


@look()
def dose(runs: pd.DataFrame, cells: pd.DataFrame) -> Figure:
    """Success at the last step against the weight of a variant that has several, a panel per protocol.

    A dot per run, a diamond at the mean with its interval; at the left the runs without shaping.
    """
    sizes = cells[cells["variant"] != "none"].groupby(["protocol", "variant"])["alpha0"].nunique()
    chosen = list(sizes[sizes >= DOSES].index)
    protocols = [name for name in dict.fromkeys(runs["protocol"]) if name in {protocol for protocol, _ in chosen}]
    points, means = (
        pd.concat([_at_doses(frame, protocol, variant) for protocol, variant in chosen], ignore_index=True)
        for frame in (runs, cells)
    )
    order = ["none", *(f"{weight:g}" for weight in sorted(set(points.loc[points["weight"] != "none", "alpha0"])))]
    figure = Figure(figsize=(2.9 * len(protocols) + 0.8, 3.4))
    panels = {"col": "protocol", "order": protocols}
    name = "final_success_rate"
    plot = so.Plot(points, x="weight", y=name).facet(**panels)
    plot = plot.add(so.Dot(color=QUIET, alpha=0.6, pointsize=5, edgewidth=0), so.Jitter(0.25, seed=0))
    over_runs = {"data": means, "x": "weight", "y": name, "col": "protocol"}
    plot = plot.add(so.Range(color="black"), ymin=f"{name}_low", ymax=f"{name}_high", **over_runs)
    plot = plot.add(so.Dot(marker="D", color="black", pointsize=6), **over_runs)
    plot = plot.scale(x=so.Nominal(order=order)).limit(y=(-0.03, 1.03))
    plot = plot.label(x="", y="Success at the last step", col="")
    for axes, protocol in zip(parts.draw(plot, figure), protocols, strict=True):
        axes.set_title(protocol_label(protocol))
        axes.set_xlabel("Weight α₀")
        percent(axes.yaxis)
    return figure


def _at_doses(frame: pd.DataFrame, protocol: str, variant: str) -> pd.DataFrame:
    """The rows of a variant and of `none` under a protocol, with the `weight` as text."""
    own = frame[(frame["protocol"] == protocol) & frame["variant"].isin([variant, "none"])]
    weights = own["alpha0"].map("{:g}".format)
    return own.assign(weight=weights.where(own["variant"] != "none", "none"))


def compress(axes: Axes, values: "pd.Series[float]") -> None:
    """A logarithmic scale beyond 10 on both sides where the values are spread widely, as returns that collapse are.

    Else a few ticks.
    """
    low, high = values.min(), values.max()
    widest = max(-low, high)
    if widest <= WIDE:
        axes.locator_params(axis="x", nbins=5)
        return
    axes.set_xscale("symlog", linthresh=10)
    axes.set_xlim(*(3 * end if abs(end) > 10 else end + side for end, side in ((low, -5), (high, 5))))
    step = 1 if widest < 1e5 else 3  # decades between the numbers
    decades = [10.0**exponent for exponent in range(step, 16, step)]
    axes.set_xticks([tick for tick in (*(-decade for decade in decades), 0.0, *decades) if low <= tick <= max(high, 0)])
    axes.minorticks_off()


def _controller(controllers: pd.DataFrame | None, protocol: str) -> dict[str, float]:
    """Measures of the inverse-kinematics controller under a protocol, if the table has it."""
    if controllers is None or controllers.empty:
        return {}
    own = stochastic(controllers, protocol)
    own = own[own["controller"].str.startswith("inverse")]
    return {} if own.empty else {name: float(own[name].iloc[0]) for name in STRIP if name in own}


@look()
def effects(effects: pd.DataFrame) -> Figure:
    """A row per switch, a panel per measure: differences with their intervals, filled where zero is left out.

    `effects` as `switch_effects.effects_frame` gives it; each variant has its colour, each kind of effect its marker.
    """
    shown = effects[effects["effect"].isin(list(KINDS)) & effects["metric"].isin(list(EFFECT_LABELS))]
    shown = shown[shown["difference"].notna()]
    if shown.empty:
        return empty_figure()
    names = [switch_label(row).replace(": ", "\n", 1).replace("; ", ";\n") for row in shown.to_dict("records")]
    variants = sorted(set(shown["variant"]), key=variant_order)
    lines = [f"{variant} {kind}" for variant in variants for kind in KINDS]
    shown = shown.assign(
        row=names,
        line=pd.Categorical(shown["variant"] + " " + shown["effect"], lines),
        clear=(shown["ci_low"] > 0) | (shown["ci_high"] < 0),
    )
    rows = list(dict.fromkeys(names))
    figure = Figure(figsize=(11.0, 1.5 + 0.75 * max(len(rows), 2)))
    plot = so.Plot(shown, y="row", color="variant", group="line")
    plot = plot.facet(col="metric", order=list(EFFECT_LABELS)).share(x=False, y=True)
    scales = {"y": so.Nominal(order=rows), "color": parts.looks(variants)["color"], "marker": MARKERS}
    plot = parts.with_intervals(plot, so.Dodge(empty="fill", by=["group"]), marker="effect").scale(**scales)
    for axes, (metric, label) in zip(parts.draw(plot, figure), EFFECT_LABELS.items(), strict=True):
        own = shown[shown["metric"] == metric]
        parts.zero_line(axes)
        axes.set(title="", xlabel=label)
        axes.tick_params(axis="y", length=0)
        # One run a cell has differences and no intervals.
        compress(axes, pd.concat([own["difference"], own["ci_low"], own["ci_high"]]).dropna())
        if metric.endswith("rate"):
            percent(axes.xaxis)
        elif metric.endswith("distance"):
            millimetres(axes.xaxis)
    handles = [variant_line(name) for name in variants]
    handles += [
        Line2D([], [], color=QUIET, marker=MARKERS[kind], linestyle="none", label=label)
        for kind, label in KINDS.items()
        if kind in set(shown["effect"])
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    return figure


@look()
def log(logged: pd.DataFrame, training_logs: pd.DataFrame) -> Figure:
    """Training as each protocol logs it, smoothed, a panel per setting; published peaks and ends as diamonds.

    `logged` as `learning_curves.curve_table` gives it; `training_logs` are the published runs' summaries
    (`report/published/training_logs.csv`). The scale leaves out what falls below four times the published lowest.
    """
    if logged.empty:
        return empty_figure()
    curves, titles = parts.by_setting(
        smoothed(logged), lambda protocol, *setting: f"{protocol_label(protocol)}\n{setting_label(*setting)}"
    )
    columns = 2 if len(titles) > 3 else len(titles)
    figure = Figure(figsize=(3.7 * columns + 1.4, 3.4 * -(-len(titles) // columns) + 0.4))
    facets = {"col": "panel", "order": titles, "wrap": columns}
    panels = parts.lines(figure, curves, "iteration", "episode_return", facets, {"x": False, "y": False})
    floor = 4 * training_logs["final_return"].min()
    marked = False
    for place, (axes, title) in enumerate(zip(panels, titles, strict=True)):
        own = curves[curves["panel"] == title].iloc[0]
        same = (training_logs["protocol"] == own["protocol"]) & (training_logs["budget"] == own["budget"])
        published = training_logs[same & (own["alpha0"] == 1)]
        last = int(curves.loc[curves["panel"] == title, "iteration"].max())
        for run in published.to_dict("records"):
            marker = PUBLISHED | {"color": variant_color(run["variant"]), "label": "_published"}
            ends = [run["peak_return"], run["final_return"]]
            axes.plot([run["peak_iteration"], last], ends, linestyle="none", zorder=4, **marker)
            axes.set_ylim(min(axes.get_ylim()[0], 1.05 * min(ends)), max(axes.get_ylim()[1], max(ends) + 2))
            marked = True
        axes.set_ylim(bottom=max(axes.get_ylim()[0], floor))
        axes.set_xlabel("PPO iteration" if place >= len(titles) - columns else "")
        axes.set_ylabel("" if place % columns else "Logged return")
    mark = Line2D([], [], linestyle="none", label="published: peak, end", **PUBLISHED)
    variant_legend(figure, list(curves["variant"]), more=(mark,) if marked else ())
    return figure


def correlation(correlation: pd.DataFrame) -> Figure:
    """The published matrix and the study's over its cells."""
    return paper.matrices(
        {
            "Published Table 2": correlation[correlation["level"] == "published"],
            "Released code, labels as published": correlation[correlation["level"] == "cells"],
        }
    )


def forest(comparisons: pd.DataFrame) -> Figure:
    """Paired differences to `none` in success under the first protocol that has any."""
    return robustness.forest(comparisons[comparisons["family"] == "none"])
