"""The paper's four figures. Tables in, matplotlib figures out; no statistic is computed here."""

import textwrap
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
import seaborn as sns
import seaborn.objects as so
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from reacher_shaping.figures import parts
from reacher_shaping.figures.style import (
    PUBLISHED,
    QUIET,
    empty_figure,
    empty_panel,
    look,
    percent,
    variant_legend,
)
from reacher_shaping.labels import (
    CELL,
    in_groups,
    number,
    of_protocol,
    setting_label,
    settings_of,
    stochastic,
    variant_label,
    variant_order,
)

FAMILIES = {"constant": "Constant shaping", "linear": "Decayed shaping"}
MEASURES = {"alpha0": "α₀", "success_rate": "success\nrate", "mean_return": "mean\nreturn", "budget": "budget"}
FILLS = (0.45, 1.0, 0.0, 0.25)
"""Strength of the bars' colour by budget and alpha0, full alpha0 first; the outline of the others is dashed."""


@look()
def figure_1(curves: pd.DataFrame, protocol: str | None = None) -> Figure:
    """Training curves: constant shaping above, decay below, a column per budget and alpha0.

    `curves` as `learning_curves.curve_table` gives it. The unshaped reference `none` is drawn wherever the
    study has it; a dashed line marks the highest point of a panel's mean curves.
    """
    main = in_groups(of_protocol(curves, protocol), ["main"])
    rows = [
        main[(main["variant"] == "none") | (main["schedule"] == schedule)].assign(family=title)
        for schedule, title in FAMILIES.items()
    ]
    return _training_curves(pd.concat(rows), list(FAMILIES.values()), share_y="col")


@look()
def figure_4(curves: pd.DataFrame, protocol: str | None = None) -> Figure:
    """Training curves of decay with the L2-squared potential, a panel per budget and alpha0."""
    part = in_groups(of_protocol(curves, protocol), ["appendix"])
    return _training_curves(part.assign(family="Decay, L2²"), ["Decay, L2²"], share_y=True)


def _training_curves(curves: pd.DataFrame, families: list[str], share_y: Any) -> Figure:
    """A row per family, a column per budget and alpha0."""
    curves = curves[np.isfinite(curves["episode_return"])]
    settings = settings_of(curves)
    if not settings:
        return empty_figure()
    names = [setting_label(*setting) for setting in settings]
    at = [setting_label(*setting) for setting in zip(curves["budget"], curves["alpha0"], strict=True)]
    figure = Figure(figsize=(3.3 * len(settings) + 1.6, 2.9 * len(families) + 0.5))
    panels = parts.lines(
        figure,
        curves.assign(setting=at),
        "iteration",
        "episode_return",
        {"row": "family", "col": "setting", "order": {"row": families, "col": names}},
        {"x": "col", "y": share_y},
    )
    for place, axes in enumerate(panels):
        row, column = divmod(place, len(settings))
        axes.set_title(f"{families[row]}\n{names[column]}")
        if axes.lines:
            axes.set_xlabel("PPO iteration")
            axes.set_ylabel("" if column else "Episode return, unshaped")
            axes.tick_params(labelbottom=True, labelleft=True)
            axes.xaxis.set_major_locator(MaxNLocator(6, integer=True))
            _mark_maximum(axes)
        else:
            empty_panel(axes)
    variant_legend(figure, list(curves["variant"]))
    _explain_curves(figure, curves)
    return figure


def _mark_maximum(axes: Axes) -> None:
    """Dashed line at the highest mean return, its value written in the colour of its curve."""
    curve = max(axes.lines, key=lambda line: np.max(line.get_ydata()))
    x, y = (np.asarray(values, dtype=float) for values in curve.get_data())
    maximum = float(y.max())
    axes.axhline(maximum, color=QUIET, linestyle="--", linewidth=1, label="_maximum")
    late = x[y.argmax()] > (x[0] + x[-1]) / 2  # the number stands on the side away from the point it belongs to
    axes.annotate(
        f"max {number(maximum, 2)}", (0.0 if late else 1.0, maximum), xycoords=("axes fraction", "data"),
        xytext=(3 if late else -3, 3), textcoords="offset points", ha="left" if late else "right", va="bottom",
        fontsize=8.5, color=curve.get_color(),
    )  # fmt: skip


def _explain_curves(figure: Figure, curves: pd.DataFrame) -> None:
    """A line under the panels saying what lines and bands are."""
    least, most = curves["seeds"].min(), curves["seeds"].max()
    count = f"{most} seed{'s' if most > 1 else ''}" if least == most else f"{least} to {most} seeds"
    band = "; bands: 95 % t interval of the mean" if most > 1 else ""
    text = f"Lines: mean over {count}{band}; dashed: highest point of the mean curves"
    figure.supxlabel(textwrap.fill(text, round(13.5 * figure.get_figwidth())), fontsize=8, color=QUIET)


@look()
def figure_2(
    cells: pd.DataFrame,
    published: pd.DataFrame,
    protocol: str | None = None,
    controllers: pd.DataFrame | None = None,
) -> Figure:
    """Success rates as grouped bars with intervals; left the main grid, right decay with L2-squared.

    `cells` is the table of cells; `published` comes from `paper_tables.published_cells` and gives the diamonds;
    `controllers` (`controller`, `success_rate`) adds a line per policy that needs no learning.
    """
    ours = of_protocol(cells, protocol)
    ours = ours.merge(published[[*CELL, "success_rate"]], "left", CELL, suffixes=("", "_published"))
    settings = [setting_label(*setting) for setting in settings_of(ours)]
    sides = {
        "Main grid": in_groups(ours, ["main"]),
        "Decay with L2²": in_groups(ours, ["appendix"]),
    }
    figure = Figure(figsize=(11.5, 4.3))
    widths = [max(len(side), 4) if len(side) else 2 for side in sides.values()]
    panels = figure.subplots(1, 2, sharey=True, width_ratios=widths)
    for axes, (title, side) in zip(panels, sides.items(), strict=True):
        _bars(axes, side, settings)
        axes.set_title(title)
    panels[0].set_ylim(bottom=0)
    if controllers is not None and not controllers.empty:
        _draw_controllers(list(panels), stochastic(controllers, protocol))
    percent(panels[0].yaxis)
    panels[0].set_ylabel("Success rate: tip within the radius\nat any step of an episode")
    handles: list[Patch | Line2D] = [_key(name, **_fill(place)) for place, name in enumerate(settings)]
    handles += [Line2D([], [], color="black", label=name) for name in sorted(ours["interval"].unique())]
    handles.append(Line2D([], [], linestyle="none", label="published (one run)", **PUBLISHED))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), handlelength=1.8)
    return figure


def _bars(axes: Axes, cells: pd.DataFrame, settings: list[str]) -> None:
    """Bars of one panel, a group per variant, a place in the group per budget and alpha0."""
    if cells.empty:
        empty_panel(axes)
        return
    at = [setting_label(*setting) for setting in zip(cells["budget"], cells["alpha0"], strict=True)]
    here = [name for name in settings if name in at]
    cells = cells.assign(setting=pd.Categorical(at, here))
    variants = sorted(set(cells["variant"]), key=variant_order)
    side_by_side = so.Dodge(gap=0.08, by=["group"])
    fills = {name: _fill(settings.index(name)) for name in here}
    interval = {"ymin": "success_rate_low", "ymax": "success_rate_high"}
    parts.draw(
        so.Plot(cells, x="variant", y="success_rate", group="setting")
        .add(so.Bar(edgewidth=1), side_by_side, color="variant", alpha="setting", edgestyle="setting", legend=False)
        .add(so.Range(color="white", linewidth=2.8), side_by_side, **interval)
        .add(so.Range(color="black"), side_by_side, **interval)
        .add(so.Dot(**parts.DIAMOND), side_by_side, y="success_rate_published")
        .scale(
            x=so.Nominal(order=variants),
            color=parts.looks(variants)["color"],
            alpha={name: fill["alpha"] for name, fill in fills.items()},
            edgestyle={name: fill["linestyle"] for name, fill in fills.items()},
        )
        .label(x="", y=""),
        axes,
    )
    names = [variant_label(name).replace(",", "").replace(" ", "\n") for name in variants]
    axes.set_xticks(range(len(variants)), names)
    axes.tick_params(axis="x", length=0)
    axes.label_outer()


def _fill(place: int) -> dict[str, Any]:
    """Fill of a budget and alpha0 by its place: how strong the colour is, and the outline."""
    return {"alpha": FILLS[place % len(FILLS)], "linestyle": "-" if place < 2 else (0, (3, 1.5))}


def _key(label: str, alpha: float, linestyle: Any) -> Patch:
    """A bar as the legend shows it."""
    return Patch(label=label, facecolor=(QUIET, alpha), edgecolor=QUIET, linestyle=linestyle)


def _draw_controllers(panels: list[Axes], controllers: pd.DataFrame) -> None:
    """A dotted line per policy that needs no learning, named at the right; those off the scale are only named."""
    top = panels[0].get_ylim()[1]
    place = -top
    for row in controllers.sort_values("success_rate").to_dict("records"):
        value = row["success_rate"]
        text = str(row["controller"]).replace("_", " ")
        if value <= top:
            for axes in (panel for panel in panels if panel.patches):
                axes.axhline(value, color=QUIET, linewidth=0.9, linestyle=":", label="_controller")
        else:
            text += f"\n({100 * value:.0f} %, off the scale)"
        place = max(min(value, top), place + 0.042 * top)  # names keep a line's height between them
        panels[1].annotate(
            text, (1.0, place), xycoords=("axes fraction", "data"), xytext=(4, 0), textcoords="offset points",
            va="center" if value <= top else "bottom", fontsize=8, color=QUIET, annotation_clip=False,
        )  # fmt: skip


@look()
def figure_3(
    correlation: pd.DataFrame, correlation_published: pd.DataFrame | None = None, protocol: str | None = None
) -> Figure:
    """Pearson correlation of alpha0, success rate, mean return and budget over cells.

    `correlation` has `protocol, method, x, y, r, ci_low, ci_high, level`; the second frame, of the same form without
    a protocol, holds the coefficients of the published table and gets its own panel.
    """
    ours = of_protocol(correlation, protocol)
    frames = {"This study": ours[ours["level"] == "cells"]}
    if correlation_published is not None:
        frames["Published Table 2"] = correlation_published
    return matrices(frames)


@look()
def matrices(frames: Mapping[str, pd.DataFrame]) -> Figure:
    """Pearson's matrix of each frame, a panel each with its name as the title, and one colour bar."""
    figure = Figure(figsize=(4.6 * len(frames) + 1.3, 4.1))
    panels = figure.subplots(1, len(frames), squeeze=False)[0]
    for axes, (title, frame) in zip(panels, frames.items(), strict=True):
        axes.set_title(title)
        _draw_matrix(axes, frame)
    scale = ScalarMappable(Normalize(-1, 1), "RdBu")
    figure.colorbar(scale, ax=list(panels), shrink=0.9, label="Pearson's r over cells").outline.set_visible(False)
    return figure


def _draw_matrix(axes: Axes, frame: pd.DataFrame) -> None:
    """One heat map: the coefficient and under it its interval, both ways round."""
    chosen = frame[(frame["method"] == "pearson") & frame["x"].isin(MEASURES) & frame["y"].isin(MEASURES)]
    values = pd.DataFrame(np.eye(len(MEASURES)), list(MEASURES), list(MEASURES))
    texts = values.map("{:g}".format)
    for row in chosen[chosen["x"] != chosen["y"]].to_dict("records"):
        text = number(row["r"], 2) if np.isfinite(row["r"]) else "not\ndefined"
        if np.isfinite(row["ci_low"]):
            text += f"\n{number(row['ci_low'], 2)} to {number(row['ci_high'], 2)}"
        for x, y in ((row["x"], row["y"]), (row["y"], row["x"])):
            values.loc[x, y], texts.loc[x, y] = row["r"], text
    labels = list(MEASURES.values())
    look_of_cells = {"cmap": "RdBu", "vmin": -1, "vmax": 1, "square": True, "cbar": False, "linewidths": 0.5}
    text_of_cells = {"annot": texts.to_numpy(), "fmt": "", "annot_kws": {"fontsize": 8}}
    sns.heatmap(values.fillna(0), ax=axes, xticklabels=labels, yticklabels=labels, **look_of_cells, **text_of_cells)
    axes.tick_params(length=0, rotation=0)
