"""What each claim comes down to as a number, and how sure that number is.

Every estimate is a formula of means over seeds. A `Sample` evaluates it at once for the seeds as they are
and for bootstrap resamples of the seeds [B]. A seed is drawn for all cells together, because the same seed
means the same initial weights, targets and resets in each: differences between cells keep their pairing.
The same formulas applied to the published tables (one seed) give the published values.

A statement about a best or worst cell picks among noisy means and flatters the winner. Those estimates
carry simultaneous limits (`Sample.simultaneous`), which hold for all candidates at once and so for the
one that happened to be picked.

Axes: [B]ootstrap (row 0: the seeds as they are), [C]ell, [S]eed.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from reacher_shaping import stats
from reacher_shaping.labels import CELL

Array = NDArray[np.float64]
Cell = tuple[str, int, float]


class MissingError(Exception):
    """The study lacks a cell, a metric or a table that the estimate needs."""


class Estimate(NamedTuple):
    """A number, its 95 % limits (NaN: none) and the fewest seeds behind any mean in it."""

    value: float
    low: float
    high: float
    seeds: int


SHORT, LONG = 500_000, 1_000_000
BUDGETS = (SHORT, LONG)
CONSTANT = ("l2", "l2sq")
DECAYED = ("decay200k", "decay300k", "decay500k")
SHAPED: list[Cell] = [
    (variant, budget, alpha0)
    for budget, alpha0 in ((SHORT, 1.0), (LONG, 1.0), (SHORT, 0.5))
    for variant in CONSTANT + DECAYED
]
TABLE_2: list[Cell] = [("none", SHORT, 1.0), ("none", LONG, 1.0), *SHAPED]
TABLE_3: list[Cell] = [(f"{variant}_l2sq", budget, 0.5) for variant in DECAYED for budget in BUDGETS]
BEST: Cell = ("decay300k", LONG, 1.0)


def derive(runs: pd.DataFrame) -> pd.DataFrame:
    """Add the per-run quantities that claims average; a diverged run's stay missing.

    `early_peak`: peak within 25 to 50 iterations; `lost`: ends more than a quarter of |peak| below its peak;
    `timed`: steps to the threshold, a run that never gets there counted at its whole budget.
    """
    if "peak_return" not in runs:
        return runs
    known = runs["peak_return"].notna()
    early = runs["peak_iteration"].between(25, 50)
    lost = runs["drop_from_peak"] > 0.25 * runs["peak_return"].abs()
    timed = runs["steps_to_threshold"].fillna(runs["budget"]).astype(float)
    new = {"early_peak": early.astype(float), "lost": lost.astype(float), "timed": timed}
    return runs.assign(**{name: values.where(known) for name, values in new.items()})


class Sample:
    """The runs of one protocol under bootstrap resamples of the seeds."""

    def __init__(self, runs: pd.DataFrame, random: np.random.Generator, resamples: int = stats.RESAMPLES) -> None:
        key = ["seed", *CELL]
        metrics = runs.drop(columns=key).select_dtypes("number")
        table = metrics.set_index(pd.MultiIndex.from_frame(runs[key])).unstack(key[1:]).sort_index()
        self._columns = {column: values.to_numpy(dtype=float) for column, values in table.items()}
        self._seeds = len(table)
        as_is = np.arange(self._seeds)[None]
        self._draws = np.concatenate([as_is, stats.resample(self._seeds, resamples, random)])
        self.fewest = self._seeds

    def start(self) -> None:
        """Begin another claim: forget how few seeds the cells asked for so far had (`fewest`)."""
        self.fewest = self._seeds

    def has(self, metric: str, cell: Cell) -> bool:
        """Whether any run of the cell has the metric."""
        return (metric, *cell) in self._columns and bool(np.isfinite(self._columns[metric, *cell]).any())

    def values(self, metric: str, cell: Cell) -> Array:
        """A metric of one cell's runs [B, S]; NaN for diverged or absent runs. Raises MissingError."""
        if not self.has(metric, cell):
            raise MissingError(f"{metric} of {cell}")
        runs = self._columns[metric, *cell]
        self.fewest = min(self.fewest, int(np.isfinite(runs).sum()))
        drawn: Array = np.where(np.isfinite(runs), runs, np.nan)[self._draws]
        return drawn

    def mean(self, metric: str, cell: Cell) -> Array:
        """Mean over seeds of one cell [B]."""
        values = self.values(metric, cell)
        known = np.isfinite(values)
        count = known.sum(axis=1)
        total: Array = np.where(known, values, 0.0).sum(axis=1)
        return np.where(count > 0, total / np.maximum(count, 1), np.nan)

    def means(self, metric: str, cells: Sequence[Cell]) -> Array:
        """Means over seeds of several cells [B, C]."""
        return np.stack([self.mean(metric, cell) for cell in cells], axis=1)

    def runs(self, metric: str, cells: Sequence[Cell]) -> Array:
        """A metric of all runs of several cells [B, C * S]."""
        return np.concatenate([self.values(metric, cell) for cell in cells], axis=1)

    def estimate(self, resampled: Array) -> Estimate:
        """Expanded percentile limits (`stats.expanded_tail`) of a quantity [B]."""
        drawn = stats.finite(resampled[1:])
        if self.fewest < 2 or drawn.size == 0:
            return Estimate(float(resampled[0]), np.nan, np.nan, self.fewest)
        tail = stats.expanded_tail(self.fewest)
        low, high = np.quantile(drawn, [tail, 1 - tail])
        return Estimate(float(resampled[0]), float(low), float(high), self.fewest)

    def simultaneous(self, resampled: Array, pick: Callable[[Array], float]) -> Estimate:
        """`pick` one of several quantities [B, C] (its largest, smallest, ...), with limits at a fixed distance.

        The distance is the quantile of the largest deviation among all C. If every true value lies within it
        of its estimate, then so does every order statistic: whichever cell is picked, the limits hold.
        """
        value = float(pick(resampled[0]))
        largest = stats.finite(np.abs(resampled[1:] - resampled[0]).max(axis=1))
        if self.fewest < 2 or largest.size == 0:
            return Estimate(value, np.nan, np.nan, self.fewest)
        distance = float(np.quantile(largest, 1 - 2 * stats.expanded_tail(self.fewest)))
        return Estimate(value, value - distance, value + distance, self.fewest)


Estimates = dict[str, Estimate]


def success(s: Sample, cell: Cell) -> Array:
    """Success rate of a cell [B]."""
    return s.mean("success_rate", cell)


def over_none(s: Sample) -> Array:
    """Success of each shaped cell less that of `none` at the same budget [B, C]."""
    none = {budget: success(s, ("none", budget, 1.0)) for budget in BUDGETS}
    return np.stack([success(s, cell) - none[cell[1]] for cell in SHAPED], axis=1)


def longer(s: Sample, variants: Sequence[str]) -> Array:
    """Success at one million steps less success at half a million, alpha0 = 1 [B, C]."""
    return s.means("success_rate", [(v, LONG, 1.0) for v in variants]) - s.means(
        "success_rate", [(v, SHORT, 1.0) for v in variants]
    )


def shaping_improves(s: Sample) -> Estimates:  # noqa: D103 - the ledger says it
    gains = over_none(s)
    return {"gain": s.estimate(gains.mean(axis=1)), "share": s.estimate((gains > 0).mean(axis=1))}


def decay300k_is_best(s: Sample) -> Estimates:  # noqa: D103
    others = s.means("success_rate", [cell for cell in TABLE_2 if cell != BEST])
    margin = s.simultaneous(success(s, BEST)[:, None] - others, np.min)
    return {"margin": margin}


def decay_beats_constant(s: Sample) -> Estimates:  # noqa: D103
    decayed = s.means("success_rate", [cell for cell in SHAPED if cell[0] in DECAYED])
    constant = s.means("success_rate", [cell for cell in SHAPED if cell[0] in CONSTANT])
    return {"difference": s.estimate(decayed.mean(axis=1) - constant.mean(axis=1))}


def smoothness_goes_with_success(s: Sample) -> Estimates:  # noqa: D103
    rate = s.runs("success_rate", TABLE_2)
    smooth = -stats.spearman(s.runs("roughness", TABLE_2), rate)
    high = stats.spearman(s.runs("mean_return", TABLE_2), rate)
    return {"contrast": s.estimate(smooth - high), "smoothness": s.estimate(smooth)}


def none_stays_low(s: Sample) -> Estimates:  # noqa: D103
    short, long = (success(s, ("none", budget, 1.0)) for budget in BUDGETS)
    return {"short": s.estimate(short), "long": s.estimate(long), "change": s.estimate(long - short)}


def returns_peak_early(s: Sample) -> Estimates:  # noqa: D103
    early, lost = (s.means(metric, TABLE_2).mean(axis=1) for metric in ("early_peak", "lost"))
    return {"early": s.estimate(early), "lost": s.estimate(lost)}


def decay300k_levels(s: Sample) -> Estimates:  # noqa: D103
    return {"long": s.estimate(success(s, BEST)), "short": s.estimate(success(s, ("decay300k", SHORT, 1.0)))}


def longer_helps_some(s: Sample) -> Estimates:  # noqa: D103
    gains = longer(s, ("none", *CONSTANT, *DECAYED))
    return {"largest": s.simultaneous(gains, np.max), "smallest": s.simultaneous(gains, np.min)}


def half_alpha_hurts(s: Sample) -> Estimates:  # noqa: D103
    variants = CONSTANT + DECAYED
    full, half = (s.means("success_rate", [(v, SHORT, alpha0) for v in variants]) for alpha0 in (1.0, 0.5))
    return {"loss": s.estimate((full - half).mean(axis=1))}


def correlations(s: Sample) -> Estimates:  # noqa: D103
    rate, back = s.means("success_rate", TABLE_2), s.means("mean_return", TABLE_2)
    alpha0, budget = (np.broadcast_to([float(cell[i]) for cell in TABLE_2], rate.shape) for i in (2, 1))
    return {
        "alpha_return": s.estimate(stats.pearson(alpha0, back)),
        "success_return": s.estimate(stats.pearson(rate, back)),
        "success_budget": s.estimate(stats.pearson(rate, budget)),
    }


def success_despite_return(s: Sample) -> Estimates:  # noqa: D103
    cell, none = ("l2sq", SHORT, 0.5), ("none", SHORT, 1.0)
    ratio = s.mean("mean_return", cell) / s.mean("mean_return", none)
    return {"ratio": s.estimate(ratio), "gain": s.estimate(success(s, cell) - success(s, none))}


def l2_gains_l2sq_does_not(s: Sample) -> Estimates:  # noqa: D103
    l2, l2sq = longer(s, CONSTANT).T
    return {"contrast": s.estimate(l2 - l2sq), "l2": s.estimate(l2), "l2sq": s.estimate(l2sq)}


def best_doubles_baseline(s: Sample) -> Estimates:  # noqa: D103
    none = success(s, ("none", LONG, 1.0))
    return {"ratio": s.estimate(success(s, BEST) / np.where(none > 0, none, np.nan))}


def squared_decay_plunges(s: Sample) -> Estimates:  # noqa: D103
    final, peak = (s.means(metric, TABLE_3).mean(axis=1) for metric in ("final_return", "peak_return"))
    early = s.means("peak_iteration", TABLE_3).mean(axis=1)
    return {"ratio": s.estimate(final / peak), "peak_iteration": s.estimate(early)}


def top_five_above(s: Sample) -> Estimates:  # noqa: D103
    rates = s.means("success_rate", TABLE_2)
    return {"fifth": s.simultaneous(rates, lambda means: float(np.sort(means)[-5]))}


def shaping_is_faster(s: Sample) -> Estimates:  # noqa: D103
    none = {budget: s.mean("timed", ("none", budget, 1.0)) for budget in BUDGETS}
    saved = [1 - s.mean("timed", cell) / none[cell[1]] for cell in SHAPED]
    return {"saved": s.estimate(np.mean(saved, axis=0))}


def ppo_often_fails(s: Sample) -> Estimates:  # noqa: D103
    return {"success": s.estimate(success(s, ("none", LONG, 1.0)))}


def longer_episodes_deteriorate(s: Sample) -> Estimates:
    """C14; takes a sample with the metrics `final_distance_50` and `final_distance_500`."""
    lengths = ("final_distance_50", "final_distance_500")
    cells = [cell for cell in TABLE_2 if all(s.has(length, cell) for length in lengths)]
    if not cells:
        raise MissingError("episodes of 50 and 500 steps")
    at_50, at_500 = (s.means(length, cells).mean(axis=1) for length in lengths)
    return {"ratio": s.estimate(at_500 / at_50)}


def off_policy_is_better(peers: pd.DataFrame) -> Estimates:
    """C19, from a frame with `algorithm` (PPO, SAC, TD3), `seed`, `success_rate`: Welch intervals, few seeds."""
    names = peers["algorithm"].str.lower()
    rates = {name: peers.loc[names == name, "success_rate"] for name in names.unique()}
    found = {}
    for name in ("sac", "td3"):
        if name not in rates or "ppo" not in rates:
            raise MissingError(f"{name} and ppo among the peers")
        value = stats.mean(rates[name]) - stats.mean(rates["ppo"])
        seeds = min(len(rates[name]), len(rates["ppo"]))
        found[name] = Estimate(value, *stats.welch_interval(rates[name], rates["ppo"]), seeds)
    return found
