"""Figure 2: success rates as grouped bars. Tables in, a matplotlib figure out; no statistic is computed here."""

from typing import Any

import matplotlib as mpl
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import PercentFormatter

from reacher_shaping.figures.style import STYLE, empty_panel, variant_color
from reacher_shaping.labels import (
    CELL,
    Setting,
    in_groups,
    of_protocol,
    setting_label,
    settings_of,
    stochastic,
    variant_label,
    variant_order,
)

PUBLISHED: dict[str, Any] = {"marker": "D", "color": "black", "markeredgecolor": "white", "markersize": 6}


@mpl.rc_context(STYLE)
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
    parts = [in_groups(ours, ("none", "constant", "decay")), in_groups(ours, ("decay_l2sq",))]
    shades = {setting: index for index, setting in enumerate(settings_of(ours))}
    figure = Figure(figsize=(11.5, 4.3))
    panels = figure.subplots(1, 2, sharey=True, width_ratios=[max(len(part), 4) if len(part) else 2 for part in parts])
    for axes, part, title in zip(panels, parts, ("Main grid", "Decay with L2²"), strict=True):
        axes.set_title(title)
        _draw_bars(axes, part, published, shades)
    panels[0].set_ylim(bottom=0)
    if controllers is not None and not controllers.empty:
        _draw_controllers(list(panels), stochastic(controllers, protocol))
    panels[0].yaxis.set_major_formatter(PercentFormatter(xmax=1, decimals=0, symbol=" %"))
    panels[0].set_ylabel("Success rate: tip within the radius\nat any step of an episode")
    _legend(figure, ours, shades)
    return figure


def _draw_bars(axes: Axes, cells: pd.DataFrame, published: pd.DataFrame, shades: dict[Setting, int]) -> None:
    """Bars of one panel, a group per variant, a place in the group per budget and alpha0."""
    if cells.empty:
        empty_panel(axes, "not in this study")
        return
    here = settings_of(cells)
    width = min(0.8 / len(here), 0.4)
    variants = sorted(cells["variant"].unique(), key=variant_order)
    theirs = published.set_index(CELL)["success_rate"].to_dict()
    for cell in cells.to_dict("records"):
        setting = (int(cell["budget"]), float(cell["alpha0"]))
        x = variants.index(cell["variant"]) + (here.index(setting) - (len(here) - 1) / 2) * width
        axes.bar(x, cell["success_rate"], 0.9 * width, **_fill(variant_color(cell["variant"]), shades[setting]))
        interval = [cell["success_rate_low"], cell["success_rate_high"]]
        axes.plot([x, x], interval, color="white", linewidth=2.8, label="_halo")
        axes.plot([x, x], interval, color="black", linewidth=1.2, label="_interval")
        value = theirs.get((cell["variant"], *setting))
        if value is not None:
            axes.plot(x, value, linestyle="none", label="_published", zorder=4, **PUBLISHED)
    axes.set_xticks(
        range(len(variants)), [variant_label(name).replace(",", "").replace(" ", "\n") for name in variants]
    )
    axes.tick_params(axis="x", length=0)
    axes.grid(visible=False, axis="x")


def _fill(color: str, index: int) -> dict[str, Any]:
    """Fill of the index-th budget and alpha0: tint, full, hatched, dotted."""
    tint = tuple(0.45 * channel + 0.55 for channel in mpl.colors.to_rgb(color))
    fills: list[dict[str, Any]] = [
        {"facecolor": tint},
        {"facecolor": color},
        {"facecolor": "white", "hatch": "///"},
        {"facecolor": "white", "hatch": "..."},
    ]
    return {"edgecolor": color, "linewidth": 0.8, **fills[index % len(fills)]}


def _draw_controllers(panels: list[Axes], controllers: pd.DataFrame) -> None:
    """A dotted line per policy that needs no learning, named at the right; those off the scale are only named."""
    top = panels[0].get_ylim()[1]
    place = -top
    for row in controllers.sort_values("success_rate").to_dict("records"):
        value = row["success_rate"]
        text = str(row["controller"]).replace("_", " ")
        if value <= top:
            for axes in (panel for panel in panels if panel.patches):
                axes.axhline(value, color="#555555", linewidth=0.9, linestyle=":", label="_controller")
        else:
            text += f"\n({100 * value:.0f} %, off the scale)"
        place = max(min(value, top), place + 0.042 * top)  # names keep a line's height between them
        panels[1].annotate(
            text,
            (1.0, place),
            xycoords=("axes fraction", "data"),
            xytext=(4, 0),
            textcoords="offset points",
            va="center" if value <= top else "bottom",
            fontsize=8,
            color="#444444",
            annotation_clip=False,
        )


def _legend(figure: Figure, cells: pd.DataFrame, shades: dict[Setting, int]) -> None:
    """One legend under both panels: fills, interval, published mark."""
    handles: list[Patch | Line2D] = [
        Patch(label=setting_label(*setting), **_fill("#555555", index)) for setting, index in shades.items()
    ]
    intervals = sorted(cells["interval"].unique()) if "interval" in cells else []
    handles += [Line2D([], [], color="black", linewidth=1.2, label=label) for label in intervals]
    handles.append(Line2D([], [], linestyle="none", label="published (one run)", **PUBLISHED))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
