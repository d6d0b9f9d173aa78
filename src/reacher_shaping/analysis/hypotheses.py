"""Verdicts on our own hypotheses, by the tests that the ledger fixed before the runs (report/hypotheses.yaml)."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats as distributions

from reacher_shaping.labels import KEY
from reacher_shaping.stats import holm, welch_interval

SOLVED = 0.25
"""Final success rate from which on a run counts as one that solves the task."""
TAKEN_OFF, TAKE_OFF_WINDOW = 0.5, 5
"""Success rate in training, averaged over so many iterations, from which on a run has taken off."""


def verdicts(runs: pd.DataFrame, take_off: pd.DataFrame, ledger: Mapping[str, Any]) -> pd.DataFrame:
    """A row per hypothesis of one study.

    Args:
        runs: `runs.parquet` of the study.
        take_off: a row per run, the key, `seed` and `take_off`, see `take_off_steps`.
        ledger: the study's entry of report/hypotheses.yaml.

    Columns: `id, claim, a, b` (the cells' names), `runs` of each, `mean_a, mean_b` of the primary measure and its ends
    over runs `least_a, greatest_a, least_b, greatest_b`, the means' `difference` with Welch's 95 % limits `ci_low,
    ci_high`, the exact permutation test's `p` and Holm's `p_holm` over the family, `predicts`, `solved_a, solved_b` and
    `taken_off_a, taken_off_b` (shares of runs), `take_off_a, take_off_b` (median environment steps of those that took
    off), and `verdict`. Raises ValueError for a cell without runs.
    """
    measure = ledger["measure"]
    together = runs.merge(take_off, on=[*KEY, "seed"], how="left", validate="one_to_one")
    together[measure] = together[measure].where(~together["diverged"], 0.0).fillna(0.0)
    rows = []
    for hypothesis in ledger["hypotheses"]:
        sides = {side: _of_cell(together, hypothesis[side]) for side in ("a", "b")}
        a, b = (sides[side][measure].to_numpy(dtype=float) for side in ("a", "b"))
        low, high = welch_interval(a, b)
        row = {
            "id": hypothesis["id"],
            "claim": hypothesis["claim"],
            "predicts": hypothesis["predicts"],
            "margin": float(hypothesis.get("margin", np.nan)),
            "runs": len(a),
            "difference": a.mean() - b.mean(),
            "ci_low": low,
            "ci_high": high,
            "p": permutation_p(a, b),
        }
        for side, own in sides.items():
            started = own["take_off"].dropna()
            row |= {
                side: _name(hypothesis[side]),
                f"mean_{side}": own[measure].mean(),
                f"least_{side}": own[measure].min(),
                f"greatest_{side}": own[measure].max(),
                f"solved_{side}": (own[measure] >= SOLVED).mean(),
                f"taken_off_{side}": len(started) / len(own),
                f"take_off_{side}": started.median(),
            }
        rows.append(row)
    table = pd.DataFrame(rows)
    table["p_holm"] = holm(table["p"])
    table["verdict"] = [_verdict(row, float(ledger["error"])) for _, row in table.iterrows()]
    return table


def permutation_p(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Return the two-sided p of the difference of the means of a [N] and b [M] over all ways of dealing their runs."""

    def difference(x: NDArray[np.float64], y: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
        means: NDArray[np.float64] = x.mean(axis=axis) - y.mean(axis=axis)
        return means

    found = distributions.permutation_test((a, b), difference, vectorized=True, n_resamples=np.inf)
    return float(found.pvalue)


def _averaged(success: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return success in training [I] averaged over windows of iterations [I - window + 1]; a shorter run has none."""
    if len(success) < TAKE_OFF_WINDOW:
        return np.empty(0)
    return np.convolve(success, np.full(TAKE_OFF_WINDOW, 1 / TAKE_OFF_WINDOW), "valid")


def take_off_steps(success: NDArray[np.float64], env_steps: NDArray[np.int64]) -> float:
    """Return the environment steps [I] after which a run's success in training [I] has taken off; NaN for never."""
    reached = np.flatnonzero(_averaged(success) >= TAKEN_OFF)
    return float(env_steps[reached[0] + TAKE_OFF_WINDOW - 1]) if len(reached) else float("nan")


def take_off_frame(progress: pd.DataFrame) -> pd.DataFrame:
    """A row per run: the cell's key, seed and `take_off`, from all progress tables with the key."""
    rows = []
    for key, own in progress.sort_values("iteration").groupby([*KEY, "seed"]):
        steps = take_off_steps(own["success_rate"].to_numpy(), own["env_steps"].to_numpy())
        rows.append(dict(zip([*KEY, "seed"], key, strict=True)) | {"take_off": steps})
    return pd.DataFrame(rows)


def take_off_curves(progress: pd.DataFrame) -> pd.DataFrame:
    """Success in training as `take_off_steps` looks at it: a row per run and window of iterations, none overlapping.

    `progress` are all progress tables with the cells' keys. Columns: the key, `seed, iteration, env_steps` of the
    window's last iteration, and `success_rate`, the mean over the window.
    """
    parts = []
    for _, own in progress.sort_values("iteration").groupby([*KEY, "seed"]):
        curve = _averaged(own["success_rate"].to_numpy())[::TAKE_OFF_WINDOW]
        parts.append(own.iloc[TAKE_OFF_WINDOW - 1 :: TAKE_OFF_WINDOW].assign(success_rate=curve))
    return pd.concat(parts, ignore_index=True)[[*KEY, "seed", "iteration", "env_steps", "success_rate"]]


def _of_cell(runs: pd.DataFrame, cell: Sequence[Any]) -> pd.DataFrame:
    protocol, variant, alpha0 = cell
    chosen: pd.DataFrame = runs[
        (runs["protocol"] == protocol) & (runs["variant"] == variant) & (runs["alpha0"] == alpha0)
    ]
    if chosen.empty:
        raise ValueError(f"the hypotheses name {_name(cell)}, of which there are no runs")
    return chosen


def _name(cell: Sequence[Any]) -> str:
    protocol, variant, alpha0 = cell
    return f"{protocol} {variant} {alpha0:g}"


def _verdict(row: "pd.Series[Any]", error: float) -> str:
    """Return `supported`, `contradicted` or `open` by the rules at the head of the ledger."""
    differs = row["p_holm"] < error
    if row["predicts"] == "none":
        within = -row["margin"] <= row["ci_low"] and row["ci_high"] <= row["margin"]
        return "supported" if within else "contradicted" if differs else "open"
    predicted = row["difference"] > 0 if row["predicts"] == "positive" else row["difference"] < 0
    return ("supported" if predicted else "contradicted") if differs else "open"
