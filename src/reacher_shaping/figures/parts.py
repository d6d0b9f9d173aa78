"""What several figures are built of, drawn with seaborn: lines with bands, rows of points with intervals."""

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import seaborn.objects as so
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from reacher_shaping.figures.style import BAND, BORROWED, PUBLISHED, QUIET, STYLE, millimetres, percent, variant_look
from reacher_shaping.labels import setting_label, variant_label, variant_order

DOT: dict[str, Any] = {"marker": "o", "pointsize": 5.5, "edgecolor": "white", "edgewidth": 0.6, "linewidth": 0}
"""A run: the markers of a path without a line, which an SVG draws once and places often."""
DIAMOND: dict[str, Any] = {
    "marker": "D",
    "color": "black",
    "edgecolor": "white",
    "edgewidth": 1,
    "pointsize": 6,
    "artist_kws": {"zorder": 4},
}
LOST: dict[str, Any] = {"marker": "x", "color": "#B00020"}
ROW = 0.27
"""Height of a row in inches."""


def draw(plot: so.Plot, target: Figure | Axes) -> list[Axes]:
    """Lay a plot of seaborn's onto a figure or panel in the study's look; return the panels."""
    with warnings.catch_warnings():
        # seaborn 0.13 calls pandas 3 with an argument that pandas ignores and says so.
        warnings.filterwarnings("ignore", "The copy keyword", DeprecationWarning)
        plot.theme(STYLE).on(target).plot()
    return [target] if isinstance(target, Axes) else target.axes


def looks(variants: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Seaborn's scales of colour, dashes and marker for these variants."""
    found = {name: variant_look(name) for name in sorted(set(variants), key=variant_order)}
    return {
        "color": {name: given.color for name, given in found.items()},
        "linestyle": {name: given.dashes if given.dashes[1] else "-" for name, given in found.items()},
        "marker": {name: given.marker for name, given in found.items()},
    }


def lines(
    figure: Figure,
    frame: pd.DataFrame,
    x: str,
    y: str,
    panels: Mapping[str, Any],
    share: Mapping[str, Any],
    marked: bool = False,
) -> list[Axes]:
    """A line per variant with its band `low` to `high`, in panels by seaborn's `facet(**panels)`; returns them.

    Rows with a true `borrowed`, where the frame has it, are drawn dashed. Lines that are not `marked` point by point
    are training curves; they alone set the scale, since a band is as wide as a run that diverged makes it.
    """
    order = frame["variant"].map(variant_order)
    frame = frame.assign(order=order).sort_values(["order", x]).reset_index(drop=True)
    borrowed = frame["borrowed"] if "borrowed" in frame else pd.Series(False, frame.index)
    frame = frame.assign(dashes=frame["variant"].where(~borrowed, "borrowed"))
    scales = looks(frame["variant"])
    scales["linestyle"] |= {"borrowed": BORROWED}
    plot = so.Plot(frame, x=x, y=y, color="variant", linestyle="dashes").facet(**panels).share(**share)
    plot = plot.add(so.Band(alpha=0.07 if marked else 0.14), ymin="low", ymax="high", legend=False)
    markers = {"marker": "variant"} if marked else {}
    plot = plot.add(so.Line(pointsize=4, edgewidth=0), legend=False, **markers)
    scales = scales if marked else {name: scale for name, scale in scales.items() if name != "marker"}
    drawn = draw(plot.scale(**scales).label(x="", y="", row="", col=""), figure)
    for axes, title in zip(drawn, panels["order"], strict=False) if "wrap" in panels else ():
        axes.set_title(title)
    for axes in [] if marked else drawn:
        beside = [line.get_ydata() for other in axes.get_shared_y_axes().get_siblings(axes) for line in other.lines]
        values = np.concatenate(beside) if beside else np.zeros(1)
        axes.set_ylim(*_widened(float(values.min()), float(values.max())))
    return drawn


def by_setting(frame: pd.DataFrame, title: Callable[[str, int, float], str]) -> tuple[pd.DataFrame, list[str]]:
    """Rows with the `panel` they belong to, one per protocol, budget and alpha0, and the panels in their order.

    A panel without an unshaped cell gets that of its protocol and budget, which has no weight of its own; `borrowed` is
    true where that cell has a panel beside this one.
    """
    found: dict[tuple[str, float, int], pd.DataFrame] = {}
    for protocol, budget in frame[["protocol", "budget"]].drop_duplicates().itertuples(index=False):
        own = frame[(frame["protocol"] == protocol) & (frame["budget"] == budget)]
        plain, shaped = own[own["variant"] == "none"], own[own["variant"] != "none"]
        weights = set(shaped["alpha0"]) or set(plain["alpha0"])
        for alpha0 in weights:
            here = own[own["alpha0"] == alpha0].assign(borrowed=False)
            if "none" not in set(here["variant"]):
                reference = plain[plain["alpha0"] == plain["alpha0"].max()]
                here = pd.concat([here, reference.assign(borrowed=reference["alpha0"].isin(weights))])
            found[protocol, -alpha0, budget] = here.assign(panel=title(protocol, budget, alpha0))
    ordered = [found[key] for key in sorted(found)]
    return pd.concat(ordered, ignore_index=True), [str(part["panel"].iloc[0]) for part in ordered]


def _widened(low: float, high: float, margin: float = 0.1) -> tuple[float, float]:
    room = margin * (high - low) or 1.0
    return low - room, high + room


def cell_name(row: Mapping[Any, Any]) -> str:
    """A cell as the name of a row."""
    return f"{variant_label(row['variant'])} · {setting_label(row['budget'], row['alpha0'])}"


def strip(
    runs: pd.DataFrame,
    means: pd.DataFrame,
    measures: Mapping[str, str],
    colors: Mapping[str, str],
    published: pd.DataFrame | None = None,
    width: float = 7.5,
) -> Figure:
    """A row per row of `means`, a panel per measure: a dot per run, a bar at the mean, a line for its interval.

    `runs` and `published` have `row` and the measures, `means` also `_low` and `_high` of each; all of them `color`, a
    name that `colors` knows. A run with a true `diverged` is a cross, at the left edge where it has no value. The
    published value, one per row, is a diamond.
    """
    rows = list(means["row"])
    figure = Figure(figsize=(width, 1.3 + ROW * max(len(rows), 4)))
    crossed = runs["diverged"].eq(True) if "diverged" in runs else pd.Series(False, runs.index)
    points, lost = (_long(part, measures) for part in (runs[~crossed], runs[crossed]))
    lost = pd.concat([lost, points[points["value"].isna()]], ignore_index=True)
    place = {"x": "value", "y": "row", "col": "measure"}
    plot = so.Plot().facet(col=_long(means, measures)["measure"], order=list(measures)).share(x=False, y=True)
    intervals = {"data": _long(means, measures), "y": "row", "col": "measure"}
    plot = plot.add(so.Range(color=QUIET), xmin="low", xmax="high", orient="y", **intervals)
    bar = so.Dot(marker="|", color="black", pointsize=12, stroke=2, artist_kws={"zorder": 2.5})
    plot = plot.add(bar, x="value", **intervals)
    plot = plot.add(so.Path(**DOT, artist_kws={"zorder": 3}), data=points, color="color", legend=False, **place)
    if lost["value"].notna().any():
        plot = plot.add(
            so.Dot(**LOST, stroke=1.8, artist_kws={"zorder": 3.5}), data=lost.dropna(subset="value"), **place
        )
    if published is not None:
        plot = plot.add(so.Dot(**DIAMOND), data=_long(published, measures), **place)
    panels = draw(plot.scale(y=so.Nominal(order=rows), color=dict(colors)).label(x="", y="", col=""), figure)
    for axes, (measure, label) in zip(panels, measures.items(), strict=True):
        axes.set(title="", xlabel=label)
        axes.tick_params(axis="y", length=0)
        axes.set_ylim(len(rows) - 0.4, -0.6)
        _cross_out(axes, rows, lost[(lost["measure"] == measure) & lost["value"].isna()])
        if measure.endswith("rate"):
            percent(axes.xaxis)
        elif measure.endswith("distance"):
            millimetres(axes.xaxis)
    handles = [
        Line2D([], [], color="#777777", label="one seed", marker="o", linestyle="none", markersize=5.5),
        Line2D([], [], color="black", marker="|", markersize=9, markeredgewidth=2, label="mean and interval"),
    ]
    if published is not None:
        handles.append(Line2D([], [], linestyle="none", label="published (one run)", **PUBLISHED))
    if len(lost):
        handles.append(Line2D([], [], linestyle="none", label="diverged", markeredgewidth=1.8, **LOST))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    return figure


def _long(frame: pd.DataFrame, measures: Mapping[str, str]) -> pd.DataFrame:
    """A row per row and measure: `row, color, measure, value, low, high`."""
    kept = [name for name in ("row", "color") if name in frame]
    parts = []
    for measure in measures:
        columns = {"value": measure, "low": f"{measure}_low", "high": f"{measure}_high"}
        named = {new: frame.get(old, np.nan) for new, old in columns.items()}
        parts.append(frame[kept].assign(measure=measure, **named))
    return pd.concat(parts, ignore_index=True)


def _cross_out(axes: Axes, rows: list[str], lost: pd.DataFrame) -> None:
    """A cross at the left edge of a row for runs without a value, and their number where there are several."""
    edge = axes.get_yaxis_transform()  # x in parts of the axis, y in rows
    for name, runs in lost.groupby("row"):
        y = rows.index(str(name))
        axes.plot(0.012, y, transform=edge, linestyle="none", markeredgewidth=1.8, label="_diverged", **LOST)
        if len(runs) > 1:
            axes.text(0.027, y, f"{len(runs)} runs", transform=edge, va="center", fontsize=8, color=LOST["color"])


def shade(axes: Axes, groups: Sequence[Any]) -> None:
    """A light ground behind every second group of rows, so that a row is found again at the other side."""
    order = list(dict.fromkeys(groups))
    for y, group in enumerate(groups):
        if order.index(group) % 2 == 0:
            axes.axhspan(y - 0.5, y + 0.5, color=BAND, linewidth=0, zorder=0)


def with_intervals(plot: so.Plot, *moves: so.Move, **more: str) -> so.Plot:
    """Add to a plot with rows `y` a point at `difference`, filled where it is `clear`, and its interval.

    `more` are further properties of the points, such as a marker's column.
    """
    ground = so.Dot(color="white", edgecolor="white", pointsize=5.5, artist_kws={"zorder": 3})
    point = so.Dot(pointsize=5.5, stroke=1.3, artist_kws={"zorder": 3})
    common = {"x": "difference", "orient": "y", "legend": False, **more}
    return (
        plot.add(so.Range(linewidth=1.6), *moves, xmin="ci_low", xmax="ci_high", orient="y", legend=False)
        .add(ground, *moves, **common | {"color": None})
        .add(point, *moves, fill="clear", **common)
        .scale(fill={True: True, False: False})
        .label(x="", y="", col="")
    )


def zero_line(axes: Axes, at: float = 0.0) -> None:
    """A dashed line where nothing differs."""
    axes.axvline(at, color=QUIET, linewidth=1, linestyle="--", label="_zero", zorder=0.9)


def write_beside(axes: Axes, y: float, text: str) -> None:
    """Text at the right of row `y`."""
    axes.annotate(
        text, (1, y), xycoords=("axes fraction", "data"), xytext=(5, 0), textcoords="offset points",
        va="center", fontsize=8, color=QUIET, annotation_clip=False,
    )  # fmt: skip
