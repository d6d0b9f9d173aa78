"""Estimates of the claims: means over seeds and what is made of them, with standard errors.

A `Sample` evaluates a formula at once for all seeds and with each seed left out [K], which gives the jackknife's
standard error. A seed is left out of all cells together, because the same seed means the same initial weights, targets
and resets in each: differences between cells keep their pairing. The same formulas applied to the published tables
(one seed) give the published values.

Axes: [K] jackknife rows (row 0: all seeds), [C]ell, [S]eed.
"""

from collections.abc import Sequence
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
    """A number, its limits (NaN: none), the fewest seeds behind any mean in it, and its standard error.

    With `fisher` the number is a correlation and the error is on Fisher's scale, artanh.
    """

    value: float
    low: float
    high: float
    seeds: int
    error: float = float("nan")
    fisher: bool = False


class Sample:
    """The runs of one study (one run per cell and seed), all seeds and each left out once.

    `untrained` is the success rate of a network before training, on the same resets; None where it is not known.
    """

    def __init__(self, runs: pd.DataFrame, level: float = stats.LEVEL, untrained: float | None = None) -> None:
        key = ["seed", *CELL]
        metrics = runs.drop(columns=key).select_dtypes("number")
        table = metrics.set_index(pd.MultiIndex.from_frame(runs[key])).unstack(key[1:]).sort_index()
        self._columns = {column: values.to_numpy(dtype=float) for column, values in table.items()}
        self._weights = stats.jackknife_weights(len(table))
        self._level, self._untrained = level, untrained
        self.fewest = len(table)

    def start(self) -> None:
        """Begin another estimate: forget how few seeds the cells asked for so far had (`fewest`)."""
        self.fewest = self._weights.shape[1]

    def has(self, metric: str, cell: Cell) -> bool:
        """Whether any run of the cell has the metric."""
        return (metric, *cell) in self._columns and bool(np.isfinite(self._columns[metric, *cell]).any())

    def seeds(self, metric: str, cell: Cell) -> Array:
        """A metric of one cell's runs [S]; NaN for diverged or absent runs. Raises MissingError."""
        if not self.has(metric, cell):
            raise MissingError(f"{metric} of {cell}")
        runs = self._columns[metric, *cell]
        self.fewest = min(self.fewest, int(np.isfinite(runs).sum()))
        return np.where(np.isfinite(runs), runs, np.nan)

    def average(self, values: Array) -> Array:
        """Mean over seeds of one value per seed [S] -> [K]; NaN are left out."""
        known = np.isfinite(values)
        count = self._weights @ known
        total: Array = self._weights @ np.where(known, values, 0.0)
        return np.where(count > 0, total / np.maximum(count, 1), np.nan)

    def mean(self, metric: str, cell: Cell) -> Array:
        """Mean over seeds of one cell [K]."""
        return self.average(self.seeds(metric, cell))

    def means(self, metric: str, cells: Sequence[Cell]) -> Array:
        """Means over seeds of several cells [K, C]."""
        return np.stack([self.mean(metric, cell) for cell in cells], axis=1)

    def table(self, metric: str, cells: Sequence[Cell]) -> Array:
        """A metric of the runs of several cells [S, C]."""
        return np.stack([self.seeds(metric, cell) for cell in cells], axis=1)

    def runs(self, metric: str, cells: Sequence[Cell]) -> Array:
        """A metric of all runs of several cells in one row [K, S * C], NaN where the seed is left out."""
        rows = self.table(metric, cells)
        kept = np.where(self._weights[:, :, None] > 0, rows, np.nan)
        return kept.reshape(len(self._weights), -1)

    @property
    def untrained(self) -> float:
        """Success rate of an untrained network. Raises MissingError."""
        if self._untrained is None:
            raise MissingError("success of an untrained network")
        return self._untrained

    def estimate(self, values: Array) -> Estimate:
        """A quantity [K] with its jackknife t interval."""
        error = float(stats.jackknife_error(values, self.fewest))
        half = stats.t_quantile(self.fewest, self._level) * error
        return Estimate(float(values[0]), float(values[0] - half), float(values[0] + half), self.fewest, error)

    def rate(self, values: Array) -> Estimate:
        """A rate or share [K]; its limits end at 0 and 1, as those of the tables do."""
        found = self.estimate(values)
        low, high = np.clip([found.low, found.high], 0.0, 1.0)
        return found._replace(low=float(low), high=float(high))

    def correlation(self, values: Array) -> Estimate:
        """A correlation [K], its interval and error on Fisher's scale."""
        low, high = stats.fisher_interval(values, self.fewest, self._level)
        error = float(stats.jackknife_error(stats.fisher(values), self.fewest))
        return Estimate(float(values[0]), low, high, self.fewest, error, fisher=True)

    def ranked(self, values: Array, rank: int) -> Estimate:
        """The `rank`-th largest of several quantities [K, C], with limits that hold whichever that is."""
        errors = stats.jackknife_error(values, self.fewest)
        picked = np.argsort(values[0])[-rank]
        low, high = stats.ranked_interval(values[0], errors, rank, self.fewest, self._level)
        return Estimate(float(values[0, picked]), low, high, self.fewest, float(errors[picked]))

    def share_above_zero(self, values: Array) -> Estimate:
        """Share of several quantities [K, C] that are positive, with limits that hold for all of them at once."""
        errors = stats.jackknife_error(values, self.fewest)
        reach = stats.t_quantile(self.fewest, self._level, among=values.shape[1]) * errors
        low, value, high = (float(np.mean(values[0] + shift > 0)) for shift in (-reach, 0.0, reach))
        if np.isnan(reach).any():
            low = high = float("nan")
        return Estimate(value, low, high, self.fewest)
