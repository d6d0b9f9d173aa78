"""Correlations between what a cell is set to and what comes out, over cells and over runs.

A seed is left out of all cells at once (`stats.jackknife_error`): cells share their seeds, and a cell of the longer
budget goes on where the same runs of the shorter one ended, so neither cells nor runs are independent. The intervals
say how far other seeds would move r; which cells there are is the design's. The published runs have one seed and so no
interval. Of two settings r is a constant of the design.
"""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from reacher_shaping import stats
from reacher_shaping.labels import KEY

CORRELATED = ["alpha0", "success_rate", "mean_return", "budget"]
MEASURED = ("success_rate", "mean_return")
LEVELS = ("cells", "runs")
COLUMNS = ["method", "x", "y", "r", "ci_low", "ci_high", "n", "level"]


def in_table_2(frame: pd.DataFrame) -> "pd.Series[bool]":
    """Rows of the paper's main table; its correlation matrix leaves the appendix out."""
    return frame["group"] == "main"


def in_paper(frame: pd.DataFrame) -> "pd.Series[bool]":
    """Rows of cells that the paper has, in its main table or its appendix."""
    return frame["group"] != "extra"


def correlations(runs: pd.DataFrame, level: str) -> pd.DataFrame:
    """Full matrices (both methods) over `CORRELATED`, long form: method, x, y, r, ci_low, ci_high, n, level.

    `level` starts with "cells": the means over seeds of the cells are correlated; with "runs": the single runs. A run
    that diverged has no value and is left out. `runs` may come from several protocols; a cell is one row or one group.
    """
    columns, count = _columns(runs, single=level.startswith("runs"))
    seeds = runs["seed"].nunique()
    records = []
    for method, measure in stats.CORRELATIONS.items():
        for i, x in enumerate(CORRELATED):
            for y in CORRELATED[i:]:
                values = measure(columns[x], columns[y])
                measured = x != y and (x in MEASURED or y in MEASURED)
                low, high = stats.fisher_interval(values, seeds) if measured else stats.NO_INTERVAL
                pairs = [(x, y)] if x == y else [(x, y), (y, x)]
                records += [(method, *pair, float(values[0]), low, high, count, level) for pair in pairs]
    return pd.DataFrame(records, columns=COLUMNS)


def _columns(runs: pd.DataFrame, single: bool) -> tuple[dict[str, NDArray[np.float64]], int]:
    """What is correlated, with all seeds and with each left out [K, N], and the number of rows N that have a value."""
    rows = runs.assign(protocol=runs.get("protocol", ""), budget=runs["budget"].astype(float))
    wide = rows.pivot(index="seed", columns=KEY, values=list(MEASURED))
    weights = stats.jackknife_weights(len(wide))[:, :, None]
    columns, known = {}, np.zeros(0)
    for name in MEASURED:
        values = wide[name].to_numpy(dtype=float)
        finite = np.isfinite(values)
        kept = np.where((weights > 0) & finite, values, np.nan)
        if single:
            columns[name] = kept.reshape(len(kept), -1)
        else:
            total = (weights * np.where(finite, values, 0.0)).sum(axis=1)
            columns[name] = total / np.where((there := (weights * finite).sum(axis=1)) > 0, there, np.nan)
        known = np.isfinite(columns[name][0])
    for name in ("alpha0", "budget"):
        setting = wide[MEASURED[0]].columns.get_level_values(name).to_numpy(dtype=float)
        repeated = np.tile(setting, len(wide)) if single else setting
        columns[name] = np.broadcast_to(repeated, columns[MEASURED[0]].shape)
    return columns, int(known.sum())


def by_protocol(runs: pd.DataFrame) -> pd.DataFrame:
    """`correlation.csv`: the matrices of each protocol at four levels, with `protocol` as last column.

    | level | rows |
    |---|---|
    | cells | means over seeds of the cells in the paper's main table: what its Fig. 3 correlates |
    | runs | the single runs of those cells |
    | cells_all, runs_all | the same with the appendix's cells |
    """
    parts = [
        correlations(chosen, level + suffix).assign(protocol=protocol)
        for protocol, own in runs[in_paper(runs)].groupby("protocol")
        for suffix, chosen in (("", own[in_table_2(own)]), ("_all", own))
        for level in LEVELS
        if len(chosen)
    ]
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=[*COLUMNS, "protocol"])


def over_protocols(runs: pd.DataFrame, published: pd.DataFrame, name: str) -> pd.DataFrame:
    """Correlations over all cells of a further study, whatever their protocol, in the form of `correlation.csv`.

    Levels: `cells` and `runs` are the paper's main table, so without the appendix's variants and a baseline labelled
    with another alpha0 than 1; `cells_all` has them too; `seed0`, `seed1`, ...: what a study of that seed would have
    reported; and `published`, the paper's own table (`published` comes from `paper_tables.published_cells`).
    """
    labelled = (runs["variant"] == "none") & (runs["alpha0"] != 1)
    kept = runs[in_table_2(runs) & ~labelled]
    levels = {"cells": kept, "runs": kept, "cells_all": runs[in_paper(runs)]}
    levels["published"] = published[in_table_2(published)].assign(seed=0)
    levels |= {f"seed{seed}": rows for seed, rows in kept.groupby("seed")}
    parts = [correlations(rows, level) for level, rows in levels.items() if len(rows)]
    return pd.concat(parts, ignore_index=True).assign(protocol=name)


def of_published(published: pd.DataFrame) -> pd.DataFrame:
    """The matrices of the published main table, a cell a run (`paper_tables.published_cells`)."""
    return correlations(published[in_table_2(published)].assign(seed=0), "cells").assign(protocol="published")
