"""Figures of a study with hypotheses: how each run takes off, and which targets are missed. Tables in, figures out."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
import seaborn.objects as so
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from reacher_shaping.analysis.target_maps import SQUARE
from reacher_shaping.figures import parts
from reacher_shaping.figures.studies import protocol_label
from reacher_shaping.figures.style import empty_figure, look, percent
from reacher_shaping.labels import variant_label, variant_order

COLORS, SHARES = "viridis_r", Normalize(0.0, 1.0)


@look()
def takeoff(takeoff: pd.DataFrame) -> Figure:
    """Success in training against the steps, a line per run: a row of panels per protocol, a panel per cell.

    `takeoff` as `hypotheses.take_off_curves` gives it.
    """
    if takeoff.empty:
        return empty_figure()
    named, protocols, names = _named(takeoff)
    figure = Figure(figsize=(1.55 * len(names) + 1.0, 1.3 * len(protocols) + 0.9))
    named = named.assign(run=named["seed"].astype(str) + " " + named["budget"].astype(str))
    named["thousands"] = named["env_steps"] / 1000
    plot = so.Plot(named, x="thousands", y="success_rate", color="variant", group="run")
    plot = plot.facet(row="protocol", col="cell", order={"row": protocols, "col": names})
    plot = plot.add(so.Line(linewidth=0.9, alpha=0.8), legend=False)
    plot = plot.scale(color=parts.looks(named["variant"])["color"]).limit(y=(-0.03, 1.03))
    drawn = parts.draw(plot.label(x="", y="", row="", col=""), figure)
    panels: Any = np.array(drawn, dtype=object).reshape(len(protocols), len(names))
    _explain(panels, named, protocols, names, beside=0.45)
    for axes in panels[:, 0]:
        percent(axes.yaxis)
    figure.supxlabel("Environment steps (thousands)", fontsize=9)
    figure.supylabel("Success while training, any step", fontsize=9)
    return figure


@look()
def targets(targets: pd.DataFrame) -> Figure:
    """The plane of the targets, coloured by how often episodes do not end at them: panels as above.

    `targets` as `target_maps.target_map` gives it.
    """
    if targets.empty:
        return empty_figure()
    named, protocols, names = _named(targets)
    figure = Figure(figsize=(1.45 * len(names) + 1.4, 1.45 * len(protocols) + 0.6))
    panels = figure.subplots(len(protocols), len(names), sharex=True, sharey=True, squeeze=False)
    reach = named[["target_x", "target_y"]].abs().to_numpy().max() + SQUARE / 2
    edges = np.arange(-reach, reach + SQUARE / 2, SQUARE)
    for (protocol, name), own in named.groupby(["protocol", "cell"]):
        missed = np.full((len(edges) - 1, len(edges) - 1), np.nan)
        places = [np.searchsorted(edges, own[axis]) - 1 for axis in ("target_y", "target_x")]
        missed[tuple(places)] = 1.0 - own["final_success_rate"]
        panel: Axes = panels[protocols.index(str(protocol)), names.index(str(name))]
        panel.pcolormesh(edges, edges, missed, norm=SHARES, cmap=COLORS, rasterized=True)  # an image, not 2,700 paths
    for axes in panels.flat:
        axes.set(aspect="equal", xticks=[], yticks=[])
        axes.grid(visible=False)
    _explain(panels, named, protocols, names, beside=0.08)
    bar = figure.colorbar(
        ScalarMappable(SHARES, COLORS),
        ax=panels.ravel().tolist(),
        shrink=0.6,
        label="Episodes that do not end at the target",
    )
    percent(bar.ax.yaxis)
    return figure


def _named(frame: pd.DataFrame) -> tuple[pd.DataFrame, list[str], list[str]]:
    """Rows with the `cell` that they belong to, the protocols, those of most cells first, and the cells in order."""
    named = frame.assign(cell=[_cell(row) for row in frame[["variant", "alpha0"]].to_dict("records")])
    cells = named[["variant", "alpha0", "cell"]].drop_duplicates().to_dict("records")
    names = [row["cell"] for row in sorted(cells, key=lambda row: (variant_order(row["variant"]), row["alpha0"]))]
    sizes = named.groupby("protocol", sort=False)["cell"].nunique()
    return named, sorted(sizes.index, key=lambda name: -sizes[name]), list(dict.fromkeys(names))


def _cell(row: Mapping[Any, Any]) -> str:
    """A cell over its panels."""
    weight = f"α₀ = {row['alpha0']:g}"
    return "none" if row["variant"] == "none" else f"{variant_label(row['variant'])}\n{weight}"


def _explain(panels: Any, named: pd.DataFrame, protocols: list[str], names: list[str], beside: float) -> None:
    """Name the cells above the columns and the protocols `beside` the rows; leave out panels of cells that are not."""
    there = set(named[["protocol", "cell"]].itertuples(index=False, name=None))
    shown = np.array([[(protocol, name) in there for name in names] for protocol in protocols])
    for (row, column), axes in np.ndenumerate(panels):
        own: Axes = axes
        own.set_visible(bool(shown[row, column]))
        own.set_title("", loc="left")
        own.set_title(names[column] if not shown[:row, column].any() else "", fontsize=8.5, loc="center")
        own.tick_params(labelbottom=not shown[row + 1 :, column].any())
        if not shown[row, :column].any():
            label = protocol_label(protocols[row]).replace(" ", "\n")
            place: dict[str, Any] = {"xycoords": "axes fraction", "ha": "right", "va": "center", "fontsize": 8.5}
            own.annotate(label, (-beside, 0.5), **place)
