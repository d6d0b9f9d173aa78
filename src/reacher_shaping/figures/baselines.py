"""Other algorithms beside this study, drawn."""

from typing import Any

import matplotlib as mpl
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from reacher_shaping.analysis.baselines import by_algorithm, peer_table
from reacher_shaping.figures.robustness import AXIS_LABELS, draw_runs, explain_runs, name_rows
from reacher_shaping.figures.style import STYLE, empty_panel, variant_color
from reacher_shaping.labels import budget_label, of_protocol

COLORS = {"ppo": "#56B4E9", "sac": "#882255", "td3": "#999933"}
SHOWN = ("success_rate", "mean_return")


@mpl.rc_context(STYLE)
def peer_strip(
    peers: pd.DataFrame,
    runs: pd.DataFrame,
    cells: pd.DataFrame,
    controllers: pd.DataFrame | None = None,
    protocol: str | None = None,
) -> Figure:
    """A row per row of `peer_table`, a dot per seed, a bar at the mean: success rate left, return right."""
    table = peer_table(peers, cells, controllers, protocol)
    figure = Figure(figsize=(9.0, 1.3 + 0.36 * max(len(table), 3)))
    panels = figure.subplots(1, len(SHOWN), sharey=True)
    if peers.empty:
        for axes in panels:
            empty_panel(axes, "not in this study")
        return figure
    none = of_protocol(runs, protocol)
    none = none[none["variant"] == "none"]
    parts = [own for _, own in by_algorithm(peers)] + [own for _, own in none.groupby("budget")]
    colors = [COLORS.get(key[0], variant_color(key[0])) for key, _ in by_algorithm(peers)]
    colors += [variant_color("none")] * (len(table) - len(colors))
    for axes, metric in zip(panels, SHOWN, strict=True):
        for y, row in enumerate(table.to_dict("records")):
            own = parts[y] if y < len(parts) else pd.DataFrame({metric: []})
            draw_runs(axes, y, own, row, metric, colors[y])
        axes.set_xlabel(AXIS_LABELS[metric])
    panels[0].set_xlim(left=-0.03)
    panels[0].xaxis.set_major_formatter(PercentFormatter(xmax=1, decimals=0, symbol=" %"))
    name_rows(panels[0], [_row_name(row) for row in table.to_dict("records")])
    panels[1].grid(visible=False, axis="y")
    panels[1].tick_params(axis="y", length=0)
    explain_runs(figure)
    return figure


def _row_name(row: dict[Any, Any]) -> str:
    return str(row["policy"]) + (f" · {budget_label(int(row['budget']))}" if pd.notna(row["budget"]) else "")
