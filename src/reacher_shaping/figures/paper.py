"""The paper's four figures. Tables in, matplotlib figures out; no statistic is computed here."""

import textwrap
from collections.abc import Mapping

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.collections import FillBetweenPolyCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from reacher_shaping.figures.bars import figure_2
from reacher_shaping.figures.style import STYLE, empty_panel, save, variant_color
from reacher_shaping.labels import (
    Setting,
    in_groups,
    number,
    of_protocol,
    setting_label,
    settings_of,
    variant_label,
    variant_order,
)

__all__ = ["figure_1", "figure_2", "figure_3", "figure_4", "save"]
NO_SETTING: Setting = (0, 1.0)
MEASURES = {
    "alpha0": "α₀",
    "success_rate": "success\nrate",
    "mean_return": "mean\nreturn",
    "budget": "budget",
}


@mpl.rc_context(STYLE)
def figure_1(curves: pd.DataFrame, protocol: str | None = None) -> Figure:
    """Training curves: constant shaping above, decay below, a column per budget and alpha0.

    `curves` as `learning_curves.curve_table` gives it. The unshaped reference `none` is drawn wherever the
    study has it; a dashed line marks the highest point of a panel's mean curves.
    """
    main = in_groups(of_protocol(curves, protocol), ("none", "constant", "decay"))
    rows = {"constant": "Constant shaping", "decay": "Decayed shaping"}
    settings = settings_of(main) or [NO_SETTING]
    figure = Figure(figsize=(3.3 * len(settings) + 1.4, 6.0))
    panels = figure.subplots(2, len(settings), sharey="col", squeeze=False)
    for row, (family, title) in enumerate(rows.items()):
        for column, setting in enumerate(settings):
            part = _at(in_groups(main, ("none", family)), setting)
            _draw_curves(panels[row, column], part, _title(title, setting))
        _label_curves(list(panels[row]))
    _explain_curves(figure, main)
    return figure


@mpl.rc_context(STYLE)
def figure_4(curves: pd.DataFrame, protocol: str | None = None) -> Figure:
    """Training curves of decay with the L2-squared potential, a panel per budget and alpha0."""
    part = in_groups(of_protocol(curves, protocol), ("decay_l2sq",))
    settings = settings_of(part) or [NO_SETTING]
    figure = Figure(figsize=(3.9 * len(settings) + 1.6, 3.4))
    panels = figure.subplots(1, len(settings), sharey=True, squeeze=False)[0]
    for axes, setting in zip(panels, settings, strict=True):
        _draw_curves(axes, _at(part, setting), _title("Decay, L2²", setting))
    _label_curves(list(panels))
    _explain_curves(figure, part)
    return figure


def _explain_curves(figure: Figure, curves: pd.DataFrame) -> None:
    """A line under the panels saying what lines and bands are."""
    seeds = sorted(curves["seeds"].unique())
    if not seeds:
        return
    several = "s" if seeds[-1] > 1 else ""
    count = f"{seeds[0]}" if len(seeds) == 1 else f"{seeds[0]} to {seeds[-1]}"
    band = "; bands: 95 % t interval of the mean" if several else ""
    text = f"Lines: mean over {count} seed{several}{band}; dashed: highest point of the mean curves"
    text = textwrap.fill(text, round(13.5 * figure.get_figwidth()))
    figure.supxlabel(text, fontsize=8, color="#555555")


def _title(title: str, setting: Setting) -> str:
    return title if setting == NO_SETTING else f"{title}\n{setting_label(*setting)}"


def _at(frame: pd.DataFrame, setting: Setting) -> pd.DataFrame:
    return frame[(frame["budget"] == setting[0]) & (frame["alpha0"] == setting[1])]


def _draw_curves(axes: Axes, curves: pd.DataFrame, title: str) -> None:
    """One panel: a mean curve with its band per variant, and a dashed line at the maximum."""
    axes.set_title(title)
    curves = curves[np.isfinite(curves["episode_return"])]
    if curves.empty:
        empty_panel(axes, "not in this study")
        return
    for variant in sorted(curves["variant"].unique(), key=variant_order):
        line = curves[curves["variant"] == variant]
        x = line["iteration"].to_numpy()
        color = variant_color(variant)
        band = (line["low"].to_numpy(), line["high"].to_numpy())
        fill = FillBetweenPolyCollection("x", x, *band, color=color, alpha=0.16, linewidth=0)
        axes.add_collection(fill, autolim=False)  # the mean curves alone set the scale
        axes.plot(x, line["episode_return"].to_numpy(), color=color, label=variant_label(variant))
    _mark_maximum(axes, curves)


def _mark_maximum(axes: Axes, curves: pd.DataFrame) -> None:
    """Dashed line at the highest mean return, its value written in the colour of its curve."""
    best = curves.iloc[int(curves["episode_return"].to_numpy().argmax())]
    maximum = float(best["episode_return"])
    axes.axhline(maximum, color="#555555", linestyle="--", linewidth=1, label="_maximum")
    # The number stands on the side away from the point it belongs to.
    late = best["iteration"] > curves["iteration"].mean()
    axes.annotate(
        f"max {number(maximum, 2)}",
        (0.0 if late else 1.0, maximum),
        xycoords=("axes fraction", "data"),
        xytext=(3 if late else -3, 3),
        textcoords="offset points",
        ha="left" if late else "right",
        va="bottom",
        fontsize=8.5,
        color=variant_color(best["variant"]),
    )
    axes.margins(x=0.01, y=0.15)
    axes.xaxis.set_major_locator(MaxNLocator(6, integer=True))


def _label_curves(row: list[Axes]) -> None:
    """Axis labels of a row of panels and one legend at its right."""
    drawn = [axes for axes in row if axes.lines]
    handles = {}
    for axes in drawn:
        axes.set_xlabel("PPO iteration")
        lines, labels = axes.get_legend_handles_labels()
        handles.update(dict(zip(labels, lines, strict=True)))
    if drawn:
        drawn[0].set_ylabel("Episode return, unshaped")
        row[-1].legend(
            list(handles.values()),
            list(handles),
            loc="center left",
            bbox_to_anchor=(1.02, 0.5),
            handlelength=1.4,
        )


@mpl.rc_context(STYLE)
def figure_3(
    correlation: pd.DataFrame, published_correlation: pd.DataFrame | None = None, protocol: str | None = None
) -> Figure:
    """Pearson correlation of alpha0, success rate, mean return and budget over cells.

    `correlation` has `protocol, method, x, y, r, ci_low, ci_high, level`; the second frame, of the same form without
    a protocol, holds the coefficients of the published table and gets its own panel.
    """
    ours = of_protocol(correlation, protocol)
    frames = {"This study": ours[ours["level"] == "cells"]}
    if published_correlation is not None:
        frames["Published Table 2"] = published_correlation[published_correlation["level"] == "cells"]
    return matrices(frames)


@mpl.rc_context(STYLE)
def matrices(frames: Mapping[str, pd.DataFrame]) -> Figure:
    """A panel per frame of correlations, under its title; the frames hold one level each, as `correlation.csv`."""
    figure = Figure(figsize=(4.6 * len(frames) + 0.8, 4.5))
    panels = figure.subplots(1, len(frames), squeeze=False)[0]
    for axes, (title, frame) in zip(panels, frames.items(), strict=True):
        axes.set_title(title)
        image = _draw_matrix(axes, frame)
    figure.colorbar(image, ax=list(panels), label="Pearson's r over cells", shrink=0.85)
    return figure


def _draw_matrix(axes: Axes, correlation: pd.DataFrame) -> mpl.image.AxesImage:
    """The coefficients as coloured squares, each with its number and interval."""
    names = list(MEASURES)
    chosen = correlation[correlation["method"] == "pearson"]
    matrix = np.full((len(names), len(names)), np.nan)
    np.fill_diagonal(matrix, 1.0)
    texts = {(i, i): "1" for i in range(len(names))}
    for row in chosen.to_dict("records"):
        if row["x"] == row["y"] or row["x"] not in names or row["y"] not in names:
            continue
        text = number(row["r"], 2) if np.isfinite(row["r"]) else "not\ndefined"
        if np.isfinite(row["ci_low"]):
            text += f"\n{number(row['ci_low'], 2)} to {number(row['ci_high'], 2)}"
        for place in (
            (names.index(row["x"]), names.index(row["y"])),
            (names.index(row["y"]), names.index(row["x"])),
        ):
            matrix[place] = row["r"]
            texts[place] = text
    image = axes.imshow(matrix, cmap="RdBu", vmin=-1, vmax=1)
    for (i, j), text in texts.items():
        strong = abs(np.nan_to_num(matrix[i, j])) > 0.65
        color = "white" if strong else "black"
        axes.text(j, i, text, ha="center", va="center", color=color, fontsize=8.5)
    labels = list(MEASURES.values())
    axes.set_xticks(range(len(names)), labels)
    axes.set_yticks(range(len(names)), labels)
    axes.tick_params(length=0)
    axes.grid(False)
    axes.spines[:].set_visible(False)
    return image
