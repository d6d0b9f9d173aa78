"""Statistics on samples of seeds: intervals, correlations, paired comparisons, power.

Method. A run (one seed) is the unit of replication: its 1000 evaluation episodes say how good *that
policy* is, and only other seeds say how good *the training rule* is. So every interval here is taken
over seeds. With a single seed no such interval exists; `wilson_interval` then gives the weaker one over
episodes, which must be labelled as such.

All functions are pure: arrays in, numbers or arrays out, randomness from the generator passed in.
Axes: [S]eed, [E]pisode, [B]ootstrap resample, [N] rows of a table.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy import stats

RESAMPLES = 4000
LEVEL = 0.95


class Interval(NamedTuple):
    """Limits of an interval; NaN where it does not exist."""

    low: float
    high: float


class Comparison(NamedTuple):
    """Paired comparison: mean difference, its interval, sign-flip p, number of common seeds."""

    difference: float
    low: float
    high: float
    p: float
    seeds: int


NO_INTERVAL = Interval(float("nan"), float("nan"))


def finite(sample: ArrayLike) -> NDArray[np.float64]:
    """The finite values of a sample, flat. A diverged run has no value; it is counted elsewhere."""
    values = np.asarray(sample, dtype=float).ravel()
    kept: NDArray[np.float64] = values[np.isfinite(values)]
    return kept


def mean(sample: ArrayLike) -> float:
    """Mean of the finite values [S]; NaN when there is none."""
    values = finite(sample)
    return float(values.mean()) if values.size else float("nan")


def iqm(sample: ArrayLike) -> float:
    """Interquartile mean [S]: the mean without the lowest and highest quarter (Agarwal et al. 2021).

    Of n values `int(n / 4)` are cut on either side, so up to three seeds it is the mean.
    """
    values = finite(sample)
    return float(stats.trim_mean(values, 0.25)) if values.size else float("nan")


def resample(count: int, resamples: int, generator: np.random.Generator) -> NDArray[np.int64]:
    """Row indices of a bootstrap [B, N]: N draws with replacement out of N."""
    return generator.integers(0, count, size=(resamples, count))


def expanded_tail(seeds: int, level: float = LEVEL) -> float:
    """Tail probability at which to read a bootstrap distribution of means of few values.

    The plain percentile interval is too narrow for few seeds: for ten normal values it is that of a
    normal with the uncorrected variance and covers about 90 %. The expanded percentile interval
    (Hesterberg 2015, doi:10.1080/00031305.2015.1089789) reads further out, at
    Phi(-sqrt(n / (n - 1)) t_{n-1}), which mends both faults and keeps the asymmetry of the sample.
    BCa was not taken: it corrects skewness, not these, and breaks on constant samples.
    """
    return float(stats.norm.cdf(-np.sqrt(seeds / (seeds - 1)) * stats.t.ppf(0.5 + level / 2, seeds - 1)))


def bootstrap_interval(
    sample: ArrayLike, generator: np.random.Generator, resamples: int = RESAMPLES, level: float = LEVEL
) -> Interval:
    """Expanded percentile bootstrap interval of the mean over seeds [S].

    A constant sample gives a point, fewer than two finite values give NaN. With two or three seeds the
    limits are the smallest and largest seed, still too narrow: no verdict should hang on so few.
    """
    values = finite(sample)
    if values.size < 2:
        return NO_INTERVAL
    if np.ptp(values) == 0:
        return Interval(float(values[0]), float(values[0]))
    means = values[resample(values.size, resamples, generator)].mean(axis=1)
    tail = expanded_tail(values.size, level)
    low, high = np.quantile(means, [tail, 1 - tail])
    return Interval(float(low), float(high))


def welch_interval(a: ArrayLike, b: ArrayLike, level: float = LEVEL) -> Interval:
    """Welch's t interval of mean(a) - mean(b), unpaired: for samples too small for a bootstrap."""
    ours, theirs = finite(a), finite(b)
    if min(ours.size, theirs.size) < 2:
        return NO_INTERVAL
    if np.ptp(ours) == np.ptp(theirs) == 0:
        return Interval(float(ours[0] - theirs[0]), float(ours[0] - theirs[0]))
    interval = stats.ttest_ind(ours, theirs, equal_var=False).confidence_interval(level)
    return Interval(float(interval.low), float(interval.high))


def welch_p(a: ArrayLike, b: ArrayLike) -> float:
    """Two-sided p of Welch's t test of mean(a) = mean(b), unpaired; NaN with fewer than two finite values on a side."""
    ours, theirs = finite(a), finite(b)
    if min(ours.size, theirs.size) < 2:
        return float("nan")
    if np.ptp(ours) == np.ptp(theirs) == 0:
        return 1.0 if ours[0] == theirs[0] else 0.0
    return float(stats.ttest_ind(ours, theirs, equal_var=False).pvalue)


def wilson_interval(successes: int, episodes: int, level: float = LEVEL) -> Interval:
    """Wilson score interval of a success rate over the episodes of *one* run (Wilson 1927)."""
    if episodes == 0:
        return NO_INTERVAL
    interval = stats.binomtest(int(successes), int(episodes)).proportion_ci(level, method="wilson")
    return Interval(float(interval.low), float(interval.high))


def pearson(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Pearson correlation along the last axis [..., N] over complete pairs; NaN where x or y is constant."""
    complete = np.isfinite(x) & np.isfinite(y)
    count = np.maximum(complete.sum(axis=-1, keepdims=True), 1)
    dx, dy = (_centred(values, complete, count) for values in (x, y))
    xx, yy = (dx**2).sum(axis=-1), (dy**2).sum(axis=-1)
    scale = np.sqrt(xx) * np.sqrt(yy)
    r: NDArray[np.float64] = (dx * dy).sum(axis=-1) / np.where(scale > 0, scale, np.nan)
    return np.clip(r, -1.0, 1.0)


def _centred(values: NDArray[np.float64], kept: NDArray[np.bool_], count: NDArray[np.int64]) -> NDArray[np.float64]:
    """Values less their mean where kept, else 0; a constant such as 0.1 leaves no residue of rounding."""
    values = np.where(kept, values, 0.0)
    centred = np.where(kept, values - values.sum(axis=-1, keepdims=True) / count, 0.0)
    rounding = 8 * np.finfo(float).eps * np.abs(values).max(axis=-1, keepdims=True)
    return np.where((np.abs(centred) <= rounding).all(axis=-1, keepdims=True), 0.0, centred)


def spearman(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Spearman rank correlation along the last axis [..., N] over complete pairs, ties at their mean rank."""
    complete = np.isfinite(x) & np.isfinite(y)
    # Incomplete pairs go last in both rankings and are then left out: the others' ranks do not notice.
    ranks = [stats.rankdata(np.where(complete, values, np.inf), axis=-1) for values in (x, y)]
    return pearson(np.where(complete, ranks[0], np.nan), ranks[1])


CORRELATIONS: dict[str, Callable[..., NDArray[np.float64]]] = {"pearson": pearson, "spearman": spearman}


def correlation(
    x: ArrayLike,
    y: ArrayLike,
    generator: np.random.Generator,
    method: str = "pearson",
    strata: ArrayLike | None = None,
    resamples: int = RESAMPLES // 2,
    level: float = LEVEL,
) -> tuple[float, Interval, int]:
    """Correlation of two columns [N], its percentile bootstrap interval and the number of rows used.

    Without `strata` whole rows are resampled: rows are cells, and the interval says how far r would
    move had other cells been chosen. With `strata` [N] (the cell of each run) rows are resampled
    inside their stratum: the grid stands, and the interval holds the noise of seeds alone.

    Rows with a NaN are left out; fewer than three rows or a constant column give NaN.
    """
    pairs = np.asarray([x, y], dtype=float)
    kept = np.isfinite(pairs).all(axis=0)
    xs, ys = pairs[:, kept]
    measure = CORRELATIONS[method]
    if xs.size < 3 or not np.isfinite(value := float(measure(xs, ys))):
        return float("nan"), NO_INTERVAL, int(xs.size)
    if strata is None:
        rows = resample(xs.size, resamples, generator)
    else:
        labels = np.asarray(strata)[kept]
        groups = [np.flatnonzero(labels == label) for label in np.unique(labels)]
        rows = np.concatenate([g[resample(g.size, resamples, generator)] for g in groups], axis=1)
    values = finite(measure(xs[rows], ys[rows]))
    if values.size < resamples / 2:  # most resamples constant: nothing to say about its spread
        return value, NO_INTERVAL, int(xs.size)
    low, high = np.quantile(values, [(1 - level) / 2, (1 + level) / 2])
    return value, Interval(float(low), float(high)), int(xs.size)


def sign_flip_p(differences: ArrayLike, generator: np.random.Generator, permutations: int = 9999) -> float:
    """Two-sided sign-flip permutation p of paired differences [S] (Fisher's randomisation test).

    Exact (all 2^n sign patterns) up to 14 pairs, sampled beyond; the observed pattern counts as one.
    """
    values = finite(differences)
    n = values.size
    if n == 0:
        return float("nan")
    if n <= 14:
        signs = 1 - 2 * ((np.arange(2**n)[:, None] >> np.arange(n)) & 1)
    else:
        drawn = generator.choice([-1, 1], size=(permutations, n))
        signs = np.concatenate([np.ones((1, n), dtype=drawn.dtype), drawn])
    sums = np.abs(signs @ values)
    return float((sums >= np.abs(values.sum()) - 1e-12 * np.abs(values).sum()).mean())


def paired_comparison(a: ArrayLike, b: ArrayLike, generator: np.random.Generator) -> Comparison:
    """Difference a - b on common seeds [S]: same seed means same initial weights, same targets, same resets.

    Pairs in which either run diverged (NaN) are left out.
    """
    differences = finite(np.asarray(a, dtype=float) - np.asarray(b, dtype=float))
    low, high = bootstrap_interval(differences, generator)
    return Comparison(mean(differences), low, high, sign_flip_p(differences, generator), differences.size)


def holm(p: ArrayLike) -> NDArray[np.float64]:
    """Holm's step-down adjusted p values of one family [N]; NaN stays NaN and leaves the family."""
    values = np.asarray(p, dtype=float)
    adjusted = np.full(values.shape, np.nan)
    tested = np.flatnonzero(np.isfinite(values))
    order = tested[np.argsort(values[tested], kind="stable")]
    steps = values[order] * np.arange(order.size, 0, -1)
    adjusted[order] = np.minimum(np.maximum.accumulate(steps), 1.0)
    return adjusted


def probability_of_improvement(
    a: ArrayLike, b: ArrayLike, generator: np.random.Generator, resamples: int = RESAMPLES // 2
) -> tuple[float, Interval]:
    """P(a run of A beats a run of B), ties counted half (Mann-Whitney), and its bootstrap interval."""
    ours, theirs = finite(a), finite(b)
    if ours.size == 0 or theirs.size == 0:
        return float("nan"), NO_INTERVAL
    wins = (np.sign(ours[:, None] - theirs[None, :]) + 1) / 2
    rows, columns = resample(ours.size, resamples, generator), resample(theirs.size, resamples, generator)
    drawn = wins[rows[:, :, None], columns[:, None, :]].mean(axis=(1, 2))
    low, high = np.quantile(drawn, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return float(wins.mean()), Interval(float(low), float(high))


def variance_split(rates: ArrayLike, episodes: int) -> tuple[float, float]:
    """Variance of a success rate over seeds [S], split into (seed, evaluation noise).

    Evaluation noise is the binomial variance of a rate over `episodes`, unbiased as p(1-p)/(E-1). It is
    an upper bound here, because all runs meet the same resets and share part of that noise. What is
    left of the variance over seeds is the seeds' own, at least zero.
    """
    values = finite(rates)
    if values.size < 2 or episodes < 2:
        return float("nan"), float("nan")
    noise = float((values * (1 - values)).mean() / (episodes - 1))
    return max(0.0, float(values.var(ddof=1)) - noise), noise


def power(effect: float, deviation: float, seeds: int, level: float = LEVEL) -> float:
    """Power of the two-sided paired t test: chance to detect a mean difference `effect` when paired
    differences have standard deviation `deviation`, with `seeds` pairs.
    """
    if seeds < 2 or not np.isfinite([effect, deviation]).all():
        return float("nan")
    if deviation == 0:
        return 1.0 if effect else 1 - level
    critical = stats.t.ppf(0.5 + level / 2, seeds - 1)
    shift = abs(effect) / deviation * np.sqrt(seeds)
    return float(stats.nct.sf(critical, seeds - 1, shift) + stats.nct.cdf(-critical, seeds - 1, shift))


def seeds_needed(effect: float, deviation: float, target: float = 0.8, most: int = 10_000) -> float:
    """Smallest number of paired seeds with at least `target` power; NaN if more than `most`."""
    low, high = 1, 2
    while not power(effect, deviation, high) >= target:
        low, high = high, high * 2
        if high > most:
            return float("nan")
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if power(effect, deviation, middle) >= target else (middle, high)
    return float(high)


def with_holm(frame: pd.DataFrame, family: list[str]) -> pd.DataFrame:
    """The frame with `p_holm` after `p`, corrected over the rows that share `family`."""
    corrected = frame.groupby(family)["p"].transform(holm) if len(frame) else pd.Series(dtype=float)
    frame.insert(list(frame.columns).index("p") + 1, "p_holm", corrected)
    return frame
