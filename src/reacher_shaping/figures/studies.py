"""Figures of the further studies. Tables in, matplotlib figures out; no statistic is computed here."""

import math
import re
from collections.abc import Mapping
from typing import Any

import matplotlib as mpl
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import PercentFormatter

from reacher_shaping.analysis.learning_curves import smooth
from reacher_shaping.figures import paper, robustness
from reacher_shaping.figures.bars import PUBLISHED
from reacher_shaping.figures.style import STYLE, empty_panel, save, variant_color
from reacher_shaping.labels import KEY, cell_order, setting_label, stochastic, variant_label, variant_order

__all__ = ["cells", "correlation", "draw", "effects", "forest", "log", "save"]
STRIP = {
    "success_rate": "Success, any step",
    "final_success_rate": "Success, last step",
    "mean_return": "Mean return",
}
EFFECT_LABELS = {
    "success_rate": "Success rate, any step",
    "unit_return": "Mean return at control weight 1",
    "final_distance": "Distance at the last step (m)",
}
WIDE = 150
"""Return beyond which an axis becomes logarithmic; ten times what a policy that reaches its target gets."""
KINDS = {"alone": "alone, from the start", "last": "as the last one, to the end", "all": "all together"}
MARKERS = {"alone": "o", "last": "s", "all": "D"}


def draw(view: str, tables: Mapping[str, pd.DataFrame], training_logs: pd.DataFrame) -> Figure:
    """The figure of that name (`views.VIEWS`) from an experiment's tables."""
    if view == "cells":
        return cells(tables["runs"], tables["cells"], tables["controllers"])
    if view == "effects":
        return effects(tables["effects"])
    if view == "log":
        return log(tables["logged"], training_logs)
    if view == "correlation":
        return correlation(tables["correlation"])
    return forest(tables["comparisons"])


def protocol_label(name: str) -> str:
    """`released_late_without_d1` as people read it."""
    return re.sub(r"\bd(\d)\b", r"D\1", name.replace("_", " "))


def switch_label(row: Mapping[Any, Any]) -> str:
    """A switch and, under it, what it sets."""
    if row["switch"] == "all":
        return "all switches"
    return f"{protocol_label(str(row['switch']))}: {row['setting']}"


@mpl.rc_context(STYLE)
def cells(runs: pd.DataFrame, table: pd.DataFrame, controllers: pd.DataFrame | None = None) -> Figure:
    """A row per cell of all protocols, a panel per measure: a dot per run, a bar at the mean with its interval.

    A dotted line stands at the controller that solves the task, under the protocol of the row.
    """
    order = list(dict.fromkeys(runs["protocol"]))
    rows = sorted(table.to_dict("records"), key=lambda row: (order.index(row["protocol"]), *cell_order(row)))
    figure = Figure(figsize=(11.0, 1.4 + 0.27 * max(len(rows), 4)))
    panels = figure.subplots(1, len(STRIP), sharey=True)
    by_cell = dict(iter(runs.groupby(KEY)))
    ceilings = {protocol: _controller(controllers, protocol) for protocol in order}
    for axes, (metric, label) in zip(panels, STRIP.items(), strict=True):
        for y, row in enumerate(rows):
            own = by_cell[tuple(row[name] for name in KEY)]
            robustness.draw_runs(axes, y, own, row, metric, variant_color(row["variant"]))
            ceiling = ceilings[row["protocol"]]
            if metric in ceiling:
                look = {"color": "#555555", "linestyle": ":", "linewidth": 1.2, "label": "_controller"}
                axes.plot([ceiling[metric]] * 2, [y - 0.5, y + 0.5], **look)
            if len(order) > 1 and order.index(row["protocol"]) % 2 == 0:
                axes.axhspan(y - 0.5, y + 0.5, color="#F3F5F7", linewidth=0, zorder=0)
        if metric.endswith("rate"):
            axes.xaxis.set_major_formatter(PercentFormatter(xmax=1, decimals=0, symbol=" %"))
        _compress(axes)
        axes.set_xlabel(label)
        axes.grid(visible=False, axis="y")
        axes.tick_params(axis="y", length=0)
    names = [
        f"{protocol_label(row['protocol'])} · {variant_label(row['variant'])} · "
        f"{setting_label(int(row['budget']), row['alpha0'])}"
        for row in rows
    ]
    robustness.name_rows(panels[0], names)
    robustness.explain_runs(figure)
    return figure


def _compress(axes: Axes) -> None:
    """A logarithmic scale beyond 10 on both sides where the values are spread widely, as returns that collapse are.

    Else a few ticks.
    """
    low, high = axes.dataLim.intervalx
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


@mpl.rc_context(STYLE)
def effects(table: pd.DataFrame) -> Figure:
    """A row per switch, a panel per measure: differences with their intervals, filled where zero is left out.

    `table` as `switch_effects.effects_frame` gives it; each variant has its colour, each kind of effect its marker.
    """
    shown = table[table["effect"].isin(list(KINDS)) & table["difference"].notna()]
    switches = list(dict.fromkeys(shown["switch"]))
    figure = Figure(figsize=(11.0, 1.5 + 0.75 * max(len(switches), 2)))
    panels = figure.subplots(1, len(EFFECT_LABELS), sharey=True)
    if shown.empty:
        for axes in panels:
            empty_panel(axes, "not in this study")
        return figure
    lines = list(dict.fromkeys(zip(shown["variant"], shown["effect"], strict=True)))
    lines = sorted((line for line in lines if line[1] != "all"), key=lambda line: (variant_order(line[0]), line[1]))
    for axes, (metric, label) in zip(panels, EFFECT_LABELS.items(), strict=True):
        axes.axvline(0, color="#555555", linewidth=1, linestyle="--", label="_zero", zorder=1)
        for row in shown[shown["metric"] == metric].to_dict("records"):
            y = switches.index(row["switch"]) + _offset(row, lines)
            _draw_effect(axes, y, row)
        _compress(axes)
        axes.set_xlabel(f"Change of: {label[0].lower()}{label[1:]}")
        axes.grid(visible=False, axis="y")
        axes.tick_params(axis="y", length=0)
        if metric.endswith("rate"):
            axes.xaxis.set_major_formatter(PercentFormatter(xmax=1, decimals=0, symbol=" %"))
    first = {row["switch"]: row for row in shown.to_dict("records")}
    names = [switch_label(first[switch]).replace(": ", "\n", 1).replace("; ", ";\n") for switch in switches]
    robustness.name_rows(panels[0], names)
    _explain_effects(figure, shown)
    return figure


def _offset(row: Mapping[Any, Any], lines: list[tuple[str, str]]) -> float:
    """Place of an effect within its switch's row, from -0.3 to 0.3."""
    variants = list(dict.fromkeys(line[0] for line in lines)) or [row["variant"]]
    if row["effect"] == "all":
        places, place = len(variants), variants.index(row["variant"]) if row["variant"] in variants else 0
    else:
        places, place = len(lines), lines.index((row["variant"], row["effect"]))
    return 0.0 if places == 1 else -0.3 + 0.6 * place / (places - 1)


def _draw_effect(axes: Axes, y: float, row: Mapping[Any, Any]) -> None:
    color = variant_color(row["variant"])
    clear = row["ci_low"] > 0 or row["ci_high"] < 0
    axes.plot([row["ci_low"], row["ci_high"]], [y, y], color=color, linewidth=1.6, label="_interval")
    face = color if clear else "white"
    axes.plot(row["difference"], y, MARKERS[row["effect"]], color=color, markerfacecolor=face, label="_effect")


def _explain_effects(figure: Figure, shown: pd.DataFrame) -> None:
    """A legend of variants and kinds of effect under the panels."""
    handles = [
        Line2D([], [], color=variant_color(name), linewidth=2, label=variant_label(name))
        for name in sorted(set(shown["variant"]), key=variant_order)
    ]
    handles += [
        Line2D([], [], color="#555555", marker=MARKERS[kind], linestyle="none", label=label)
        for kind, label in KINDS.items()
        if kind in set(shown["effect"])
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))


@mpl.rc_context(STYLE)
def log(logged: pd.DataFrame, training_logs: pd.DataFrame) -> Figure:
    """Training as each protocol logs it, smoothed, a panel per setting; published peaks and ends as diamonds.

    `logged` as `learning_curves.curve_table` gives it; `training_logs` are the published runs' summaries
    (`report/published/training_logs.csv`). The scale leaves out what falls below four times the published lowest.
    """
    keys = ["protocol", "budget", "alpha0"]
    settings = sorted(set(logged[keys].itertuples(index=False, name=None)), key=lambda key: (key[0], -key[2], key[1]))
    columns = 2 if len(settings) > 3 else max(len(settings), 1)
    rows = math.ceil(len(settings) / columns) or 1
    figure = Figure(figsize=(3.7 * columns + 1.2, 3.4 * rows + 0.4))
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in panels[len(settings) :]:
        axes.set_visible(False)
    floor = 4 * training_logs["final_return"].min()
    for axes, setting in zip(panels, settings, strict=False):
        part = logged[(logged[keys] == pd.Series(dict(zip(keys, setting, strict=True)))).all(axis=1)]
        axes.set_title(f"{protocol_label(setting[0])}\n{setting_label(int(setting[1]), setting[2])}")
        for variant in sorted(set(part["variant"]), key=variant_order):
            line = part[part["variant"] == variant].sort_values("iteration")
            smoothed = smooth(line["episode_return"])[0]
            iterations = line["iteration"].iloc[-len(smoothed) :]
            axes.plot(iterations, smoothed, color=variant_color(variant), label=variant_label(variant))
        if axes.get_ylim()[0] < floor:
            axes.set_ylim(bottom=floor)
        same = (training_logs["protocol"] == setting[0]) & (training_logs["budget"] == setting[1])
        theirs = training_logs[same & (setting[2] == 1)]
        for run in theirs.to_dict("records"):
            last = int(part["iteration"].max())
            marker = PUBLISHED | {"color": variant_color(run["variant"])}
            ends = [run["peak_return"], run["final_return"]]
            axes.plot([run["peak_iteration"], last], ends, linestyle="none", label="_published", zorder=4, **marker)
    for row in panels.reshape(rows, columns):
        row[0].set_ylabel("Logged return")
    for axes in panels[-columns:]:
        axes.set_xlabel("PPO iteration")
    by_label = {label: line for axes in panels for line, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    labels, handles = list(by_label), list(by_label.values())
    if any(line.get_label() == "_published" for axes in panels for line in axes.lines):
        handles.append(Line2D([], [], linestyle="none", **PUBLISHED))
        labels.append("published: peak, end")
    figure.legend(handles, labels, loc="outside right center")
    return figure


def correlation(table: pd.DataFrame) -> Figure:
    """The published matrix and the experiment's over its cells."""
    return paper.matrices(
        {
            "Published Table 2": table[table["level"] == "published"],
            "Released code, labels as published": table[table["level"] == "cells"],
        }
    )


def forest(comparisons: pd.DataFrame) -> Figure:
    """Paired differences to `none` in success under the first protocol that has any."""
    return robustness.forest(comparisons[comparisons["family"] == "none"])
