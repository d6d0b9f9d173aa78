"""Tables of the further studies: what a switch between two protocols does, what is logged, ours beside a peer.

All differences are over seeds; a switch is compared on common seeds, which share first weights, resets and noise unless
the switch itself changes how many are drawn.
Effects of a switch, each named in the column `effect`:

| effect | difference |
|---|---|
| alone | the start with the switch, less the start |
| last | the end, less the end without the switch: what it adds when all others are turned |
| interaction | last less alone: 0 if what the switch does depends on no other |
| all | the end less the start; `switch` is "all" |

Holm's correction is over all effects of one kind and metric, so that each table answers one question per metric.
"""

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd

from reacher_shaping import stats
from reacher_shaping.analysis import learning_curves
from reacher_shaping.labels import KEY
from reacher_shaping.settings.cell import Protocol
from reacher_shaping.settings.parts import Switches

EFFECT_METRICS = ("success_rate", "final_success_rate", "unit_return", "final_distance")


def unit_return(runs: pd.DataFrame, protocols: Mapping[str, Protocol]) -> "pd.Series[float]":
    """Return each run's mean return at control weight 1, Gymnasium's default, whatever weight it was trained with.

    A protocol of weight 0 charges nothing, so its runs have none (NaN).
    """
    weight = runs["protocol"].map({name: protocol.environment.control_weight for name, protocol in protocols.items()})
    return runs["reward_distance"] + runs["reward_control"] / weight.where(weight > 0)


def effects_frame(runs: pd.DataFrame, switches: Switches, protocols: Mapping[str, Protocol]) -> pd.DataFrame:
    """A row per variant, switch, effect and metric.

    Columns: variant, switch, setting (its values at start and end), effect, metric, difference, ci_low, ci_high, p,
    p_holm, seeds. Cells that are not among `runs` give no row.
    """
    runs = runs.assign(unit_return=unit_return(runs, protocols))
    by_cell = {key: own.set_index("seed") for key, own in runs.groupby(KEY)}
    rows = []
    for variant, switch, effect, terms in _contrasts(switches):
        rest = (variant, switches.budget, 1.0 if variant == "none" else switches.alpha0)
        keys = {(protocol, *rest): sign for protocol, sign in terms.items()}
        if not keys.keys() <= by_cell.keys():
            continue
        for metric in EFFECT_METRICS:
            parts = [sign * by_cell[key][metric] for key, sign in keys.items()]
            values = pd.concat(parts, axis=1, join="inner").sum(axis=1, skipna=False)
            found = stats.paired_comparison(values, np.zeros(len(values)))
            named = {"variant": variant, "switch": switch, "setting": _setting(switch, switches, protocols)}
            rows.append({**named, "effect": effect, "metric": metric} | found._asdict())
    frame = pd.DataFrame(rows, columns=["variant", "switch", "setting", "effect", "metric", *stats.Comparison._fields])
    return stats.with_holm(frame.rename(columns={"low": "ci_low", "high": "ci_high"}), ["effect", "metric"])


def _contrasts(switches: Switches) -> Iterator[tuple[str, str, str, dict[str, int]]]:
    """(variant, switch, effect, sign of each protocol) of every effect."""
    start, end = switches.start, switches.end
    rows = [("all", "all", {end: 1, start: -1})]
    for switch in switches.settings:
        alone, rest = f"{start}_with_{switch}", f"{end}_without_{switch}"
        rows += [
            (switch, "alone", {alone: 1, start: -1}),
            (switch, "last", {end: 1, rest: -1}),
            (switch, "interaction", {end: 1, rest: -1, alone: -1, start: 1}),
        ]
    return ((variant, *row) for variant in switches.variants for row in rows)


def _setting(switch: str, switches: Switches, protocols: Mapping[str, Protocol]) -> str:
    """The settings of a switch with their values, `control weight 0.1 to 1`."""
    parts = []
    for path in switches.settings.get(switch, ()):
        part, _, key = path.partition(".")
        start, end = (getattr(getattr(protocols[name], part), key) for name in (switches.start, switches.end))
        values = [f"{value:g}" if isinstance(value, float) else str(value) for value in (start, end)]
        parts.append(f"{key.replace('_', ' ')} {values[0]} to {values[1]}")
    return "; ".join(parts) or "every switch"


def logs_frame(progress: pd.DataFrame) -> pd.DataFrame:
    """A row per run on what its protocol's own log shows, from all progress tables with the cell's key.

    Columns: the key, seed, `peak_return, peak_iteration, final_return` of the logged return's moving average (as
    `learning_curves.measures`), and `action_std` of the last iteration.
    """
    rows = []
    for key, own in progress.sort_values("iteration").groupby([*KEY, "seed"]):
        found = learning_curves.measures(own["logged_return"].to_numpy())
        named = dict(zip([*KEY, "seed"], key, strict=True))
        measured = {name: float(found[name][0]) for name in ("peak_return", "peak_iteration", "final_return")}
        rows.append(named | measured | {"action_std": float(own["action_std"].iloc[-1])})
    return pd.DataFrame(rows)


def log_span(values: "pd.Series[float]") -> tuple[float, float, float]:
    """Mean over a cell's runs of a column of `logs_frame`, the least and the greatest."""
    return float(values.mean()), float(values.min()), float(values.max())
