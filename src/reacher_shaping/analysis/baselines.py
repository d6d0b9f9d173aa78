"""Our runs beside those of another implementation or algorithm."""

from typing import Any

import numpy as np
import pandas as pd

from reacher_shaping import stats
from reacher_shaping.labels import of_protocol, stochastic

ALGORITHMS = {"ppo": "PPO", "sac": "SAC", "td3": "TD3"}
BASELINE_METRICS = (
    "success_rate",
    "mean_return",
    "final_success_rate",
    "final_distance",
    "deterministic_success_rate",
    "deterministic_mean_return",
)
AGREEMENT_METRICS = (
    "success_rate",
    "final_success_rate",
    "mean_return",
    "final_distance",
    "deterministic_success_rate",
    "deterministic_final_success_rate",
    "deterministic_mean_return",
    "deterministic_final_distance",
)


def agreement_frame(runs: pd.DataFrame, peers: pd.DataFrame) -> pd.DataFrame:
    """Our unshaped cells of one protocol beside the peers of the same budget: is there a difference beyond chance?

    Columns: algorithm, budget, metric, ours, theirs, difference (ours less theirs), Welch's ci_low, ci_high and p,
    p_holm over the metrics of a peer, our_seeds, their_seeds.
    """
    rows: list[dict[str, Any]] = []
    none = runs[runs["variant"] == "none"]
    for (algorithm, budget), theirs in peers.groupby(["algorithm", "budget"]):
        ours = none[none["budget"] == budget]
        for metric in AGREEMENT_METRICS if len(ours) else ():
            low, high = stats.welch_interval(ours[metric], theirs[metric])
            means = {"ours": stats.mean(ours[metric]), "theirs": stats.mean(theirs[metric])}
            row = {"algorithm": algorithm, "budget": budget, "metric": metric, **means}
            row |= {"difference": means["ours"] - means["theirs"], "ci_low": low, "ci_high": high}
            row |= {"p": stats.welch_p(ours[metric], theirs[metric])}
            rows.append(row | {"our_seeds": len(ours), "their_seeds": len(theirs)})
    columns = ["algorithm", "budget", "metric", "ours", "theirs", "difference", "ci_low", "ci_high", "p"]
    return stats.with_holm(pd.DataFrame(rows, columns=[*columns, "our_seeds", "their_seeds"]), ["algorithm", "budget"])


def peer_table(
    peers: pd.DataFrame, cells: pd.DataFrame, controllers: pd.DataFrame | None = None, protocol: str | None = None
) -> pd.DataFrame:
    """A row per algorithm and budget of `peers`, then the study's unshaped cells and its inverse-kinematics controller.

    Columns: `policy, budget, seeds, diverged`, and those of `BASELINE_METRICS` with `_low` and `_high`, in the mode of
    the paper's evaluation; `deterministic_` ones take the mean action. A row has no limits where it has no seeds.
    """
    rows = [_peer_row(str(name), int(budget), own) for (name, budget), own in by_algorithm(peers)]
    ours = of_protocol(cells, protocol)
    for row in ours[ours["variant"] == "none"].sort_values("budget").to_dict("records"):
        kept = {str(name): value for name, value in row.items() if _is_measure(name)}
        names = {"policy": "none (this study)", "budget": row["budget"], "seeds": row["seeds"]}
        rows.append(names | {"diverged": row["diverged"]} | kept)
    rows += _controller_rows(controllers, protocol)
    columns = [f"{name}{end}" for name in BASELINE_METRICS for end in ("", "_low", "_high")]
    table = pd.DataFrame(rows).reindex(columns=["policy", "budget", "seeds", "diverged", *columns])
    return table.astype({"budget": "Int64", "seeds": "Int64", "diverged": "Int64"})


def by_algorithm(peers: pd.DataFrame) -> list[tuple[Any, pd.DataFrame]]:
    """The runs of each algorithm and budget, PPO first."""
    order = list(ALGORITHMS)
    groups = [(key, own) for key, own in peers.groupby(["algorithm", "budget"])]
    return sorted(groups, key=lambda group: (order.index(group[0][0]) if group[0][0] in order else 9, group[0]))


def _peer_row(algorithm: str, budget: int, runs: pd.DataFrame) -> dict[str, Any]:
    row: dict[str, Any] = {"policy": ALGORITHMS.get(algorithm, algorithm), "budget": budget, "seeds": len(runs)}
    row["diverged"] = int((~np.isfinite(runs["mean_return"])).sum())
    for name in BASELINE_METRICS:
        sample = runs[name]
        low, high = stats.t_interval(sample)
        if name.endswith("rate"):
            low, high = np.clip([low, high], 0.0, 1.0)
        row |= {name: stats.mean(sample), f"{name}_low": low, f"{name}_high": high}
    return row


def _is_measure(column: Any) -> bool:
    return str(column).removesuffix("_low").removesuffix("_high") in BASELINE_METRICS


def _controller_rows(controllers: pd.DataFrame | None, protocol: str | None) -> list[dict[str, Any]]:
    """The controller that solves the task, if it is there."""
    if controllers is None or controllers.empty:
        return []
    ours = stochastic(controllers, protocol)
    ours = ours[ours["controller"].str.startswith("inverse")]
    return [
        {"policy": str(row["controller"]).replace("_", " ")}
        | {name: row[name] for name in BASELINE_METRICS if name in row}
        for row in ours.to_dict("records")
    ]


def untrained_success(controllers: pd.DataFrame, protocol: str | None = None) -> float | None:
    """Success rate of a network before training, actions sampled; None where it was not evaluated."""
    ours = stochastic(controllers, protocol)
    found = ours.loc[ours["controller"] == "untrained network", "success_rate"]
    return float(found.iloc[0]) if len(found) else None
