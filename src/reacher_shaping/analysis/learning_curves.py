"""Learning curves: their mean over seeds, and the measures of one, defined once, before any curve was looked at.

A curve is the mean unshaped episode return of each iteration, [S, T] ([S]eed, iteration as [T]ime). One
iteration averages about 41 episodes and is noisy, so its maximum alone would be biased upwards and land
anywhere on a plateau. Peak, end and threshold are therefore read from one moving average over `WINDOW`
iterations (820 episodes), that of the paper's Fig. 1; as there, a window is reported at its last iteration.
What hangs on the window is shown by `roughness_by_window`, not assumed.

| measure | definition | why |
|---|---|---|
| peak_return, peak_iteration | maximum of the smoothed curve, iterations done by then | the paper sees an early peak |
| final_return | last value of the smoothed curve | smoothed as the peak is, so the drop is never negative |
| drop_from_peak | peak_return - final_return | "cannot hold what it learned" |
| shaking | deviation of first differences past the first fifth, in units of return | below |
| roughness | shaking / mean absolute return past the first fifth | below |
| area_under_curve | mean return over iterations | speed and level in one number, no threshold to choose |
| steps_to_threshold | environment steps until the smoothed curve reaches a value; NaN if never | speed alone |

Shaking and roughness. First differences remove the level and slow trends and leave the shaking from one
iteration to the next. Its scale grows with the size of the return, and every variant at -800 would seem rough;
so roughness divides by the mean absolute return, and then moves with the return by construction: what goes
with success beyond the return is asked of the shaking itself, within one budget. The curve's own deviation
would be the wrong divisor: a converged flat curve, whose deviation is sampling noise, would then be the
roughest of all. The first fifth of training is left out, else the steep first rise (learning, not
instability) would dominate.
"""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from reacher_shaping.labels import DESIGN, KEY


def curve_table(progress: pd.DataFrame, confidence: float = 0.95, column: str = "episode_return") -> pd.DataFrame:
    """Mean episode return per cell and iteration, with a t interval over seeds; unshaped unless another `column`.

    `progress` holds the cell's key (`protocol, variant, budget, alpha0`) beside the columns of
    `progress.parquet`. The result has a row per cell and iteration: the key, `iteration`,
    `env_steps`, `episode_return`, `low`, `high`, `seeds`, and the cell's design. A return that is not finite counts as
    missing, so `seeds` is the number of runs behind a point; one seed gives no band (NaN).
    """
    finite = progress.assign(episode_return=progress[column].replace([np.inf, -np.inf], np.nan))
    keys = [*KEY, "iteration", "env_steps"]
    found = finite.groupby(keys, sort=True)["episode_return"].agg(["mean", "sem", "count"])
    degrees = (found["count"] - 1).clip(lower=1)
    half_width = found["sem"] * stats.t.ppf(0.5 + confidence / 2, degrees)
    curves = pd.DataFrame(
        {
            "episode_return": found["mean"],
            "low": found["mean"] - half_width,
            "high": found["mean"] + half_width,
            "seeds": found["count"],
        }
    ).reset_index()
    design = progress[[*KEY, *DESIGN]].drop_duplicates(KEY).astype({"horizon": float})
    return curves.merge(design, on=KEY, validate="many_to_one").sort_values(keys, ignore_index=True)


EVERY = 3
"""Every third iteration of a run is enough to look at, and a third of the rows."""


def seed_curves(progress: pd.DataFrame) -> pd.DataFrame:
    """Each run's own curve, every third iteration: the cell's key, `seed, iteration, env_steps, episode_return`.

    `progress` as for `curve_table`; returns to two decimals, missing where not finite.
    """
    columns = [*KEY, "seed", "iteration", "env_steps", "episode_return"]
    shown = progress.loc[progress["iteration"] % EVERY == 1, columns].replace([np.inf, -np.inf], np.nan)
    return shown.round({"episode_return": 2}).sort_values(columns[:-2], ignore_index=True)


WINDOW = 20
BURN_IN = 0.2
WINDOWS = (1, 5, 10, 20, 40)


def smooth(curves: ArrayLike, window: int = WINDOW) -> NDArray[np.float64]:
    """Trailing moving average [S, T] -> [S, T - window + 1]; NaN spreads over the windows it is in.

    A curve shorter than five windows is smoothed over a fifth of its length, so toy runs keep a shape.
    """
    values = np.atleast_2d(np.asarray(curves, dtype=float))
    window = min(window, max(1, values.shape[1] // 5))
    means: NDArray[np.float64] = np.lib.stride_tricks.sliding_window_view(values, window, axis=1).mean(axis=-1)
    return means


def smoothed(curves: pd.DataFrame) -> pd.DataFrame:
    """The curves of a table as `curve_table` gives it, each its moving average over `WINDOW` iterations.

    A value stands at the last iteration of its window; the limits of the interval, which do not average, are left out.
    """
    parts = []
    for _, line in curves.sort_values("iteration").groupby(KEY, sort=False):
        means = smooth(line["episode_return"])[0]
        parts.append(line.iloc[-len(means) :].assign(episode_return=means, low=np.nan, high=np.nan))
    return pd.concat(parts, ignore_index=True)


def peak(curves: ArrayLike, window: int = WINDOW) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Peak of the smoothed curve [S] and the number of iterations done by then [S]; NaN if diverged."""
    values = np.atleast_2d(np.asarray(curves, dtype=float))
    smoothed = smooth(values, window)
    top = smoothed.max(axis=1)
    first = values.shape[1] - smoothed.shape[1] + 1.0
    return top, np.where(np.isfinite(top), smoothed.argmax(axis=1) + first, np.nan)


def settled(curves: ArrayLike, window: int = 1) -> NDArray[np.float64]:
    """The smoothed curve past the first fifth [S, T]."""
    values = np.atleast_2d(np.asarray(curves, dtype=float))
    return smooth(values[:, int(BURN_IN * values.shape[1]) :], window)


def shaking(curves: ArrayLike, window: int = 1) -> NDArray[np.float64]:
    """Standard deviation of first differences past the first fifth, in units of return [S].

    NaN for fewer than three points or a diverged curve.
    """
    later = settled(curves, window)
    if later.shape[1] < 3:
        return np.full(later.shape[0], np.nan)
    deviation: NDArray[np.float64] = np.diff(later, axis=1).std(axis=1, ddof=1)
    return deviation


def roughness(curves: ArrayLike, window: int = 1) -> NDArray[np.float64]:
    """Shaking over mean absolute return, past the first fifth [S].

    A pure number. NaN for fewer than three points, a diverged curve or one that is zero throughout.
    """
    level = np.abs(settled(curves, window)).mean(axis=1)
    return shaking(curves, window) / np.where(level > 0, level, np.nan)


def roughness_by_window(curves: ArrayLike, windows: Sequence[int] = WINDOWS) -> NDArray[np.float64]:
    """Roughness after smoothing over each window, [S, len(windows)]: does the order of the runs survive?"""
    return np.stack([roughness(curves, window) for window in windows], axis=1)


def steps_to_threshold(curves: ArrayLike, env_steps: ArrayLike, threshold: float) -> NDArray[np.float64]:
    """Environment steps when the smoothed curve [S, T] first reaches `threshold` [S]; NaN if never.

    `env_steps` [T] are the steps done at the end of each iteration.
    """
    smoothed = smooth(curves)
    steps = np.asarray(env_steps, dtype=float)[-smoothed.shape[1] :]
    reached = smoothed >= threshold
    return np.where(reached.any(axis=1), steps[reached.argmax(axis=1)], np.nan)


def measures(curves: ArrayLike) -> dict[str, NDArray[np.float64]]:
    """All measures of curves [S, T] that need no threshold, by column name, each [S]."""
    values = np.atleast_2d(np.asarray(curves, dtype=float))
    values = np.where(np.isfinite(values), values, np.nan)
    peak_return, peak_iteration = peak(values)
    final_return = smooth(values)[:, -1]
    return {
        "peak_return": peak_return,
        "peak_iteration": peak_iteration,
        "final_return": final_return,
        "drop_from_peak": peak_return - final_return,
        "roughness": roughness(values),
        "shaking": shaking(values),
        "area_under_curve": values.mean(axis=1),
    }
