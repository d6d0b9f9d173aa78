"""Other algorithms beside this study: a table and a figure. Intervals of the few seeds of a peer are t intervals."""

from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from reacher_shaping import stats
from reacher_shaping.further import AXIS_LABELS, draw_runs, explain_runs, name_rows
from reacher_shaping.style import STYLE, budget_label, empty_panel, of_protocol, stochastic, variant_color

NAMES = {"ppo": "PPO", "sac": "SAC", "td3": "TD3"}
COLORS = {"ppo": "#56B4E9", "sac": "#882255", "td3": "#999933"}
MEASURES = (
    "success_rate",
    "mean_return",
    "final_success_rate",
    "final_distance",
    "deterministic_success_rate",
    "deterministic_mean_return",
)
SHOWN = ("success_rate", "mean_return")


def peer_table(
    peers: pd.DataFrame, cells: pd.DataFrame, controllers: pd.DataFrame | None = None, protocol: str | None = None
) -> pd.DataFrame:
    """A row per algorithm and budget of `peers`, then the study's unshaped cells and its inverse-kinematics controller.

    Columns: `policy, budget, seeds, diverged`, and the measures of `MEASURES` with `_low` and `_high`, in the mode of
    the paper's evaluation; `deterministic_` ones take the mean action. A row has no limits where it has no seeds.
    """
    rows = [_peer_row(str(name), int(budget), own) for (name, budget), own in _groups(peers)]
    ours = of_protocol(cells, protocol)
    for row in ours[ours["variant"] == "none"].sort_values("budget").to_dict("records"):
        kept = {str(name): value for name, value in row.items() if _is_measure(name)}
        names = {"policy": "none (this study)", "budget": row["budget"], "seeds": row["seeds"]}
        rows.append(names | {"diverged": row["diverged"]} | kept)
    rows += _controller_rows(controllers, protocol)
    columns = [f"{name}{end}" for name in MEASURES for end in ("", "_low", "_high")]
    table = pd.DataFrame(rows).reindex(columns=["policy", "budget", "seeds", "diverged", *columns])
    return table.astype({"budget": "Int64", "seeds": "Int64", "diverged": "Int64"})


def _groups(peers: pd.DataFrame) -> list[tuple[Any, pd.DataFrame]]:
    """The runs of each algorithm and budget, PPO first."""
    order = list(NAMES)
    groups = [(key, own) for key, own in peers.groupby(["algorithm", "budget"])]
    return sorted(groups, key=lambda group: (order.index(group[0][0]) if group[0][0] in order else 9, group[0]))


def _peer_row(algorithm: str, budget: int, runs: pd.DataFrame) -> dict[str, Any]:
    row: dict[str, Any] = {"policy": NAMES.get(algorithm, algorithm), "budget": budget, "seeds": len(runs)}
    row["diverged"] = int((~np.isfinite(runs["mean_return"])).sum())
    for name in MEASURES:
        sample = runs[name]
        # Welch's interval against a constant is the t interval of the mean.
        low, high = stats.welch_interval(sample, np.zeros(2))
        if name.endswith("rate"):
            low, high = np.clip([low, high], 0.0, 1.0)
        row |= {name: stats.mean(sample), f"{name}_low": low, f"{name}_high": high}
    return row


def _is_measure(column: Any) -> bool:
    return str(column).removesuffix("_low").removesuffix("_high") in MEASURES


def _controller_rows(controllers: pd.DataFrame | None, protocol: str | None) -> list[dict[str, Any]]:
    """The controller that solves the task, if it is there."""
    if controllers is None or controllers.empty:
        return []
    ours = stochastic(controllers, protocol)
    ours = ours[ours["controller"].str.startswith("inverse")]
    return [
        {"policy": str(row["controller"]).replace("_", " ")} | {name: row[name] for name in MEASURES if name in row}
        for row in ours.to_dict("records")
    ]


def budgets_sentence(peers: pd.DataFrame) -> str:
    """Which algorithm had how many environment steps and seeds."""
    parts = [
        f"{NAMES.get(name, name)} {budget_label(int(budget))} ({len(own)} seed{'s' if len(own) != 1 else ''})"
        for (name, budget), own in _groups(peers)
    ]
    return f"Environment steps of training: {', '.join(parts)}."


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
    parts = [own for _, own in _groups(peers)] + [own for _, own in none.groupby("budget")]
    colors = [COLORS.get(key[0], variant_color(key[0])) for key, _ in _groups(peers)]
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
