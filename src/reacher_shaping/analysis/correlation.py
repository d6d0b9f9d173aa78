"""Correlations between what a cell is set to and what comes out, over cells and over runs."""

import numpy as np
import pandas as pd

from reacher_shaping import stats
from reacher_shaping.labels import KEY
from reacher_shaping.random_streams import generator

CORRELATED = ["alpha0", "success_rate", "mean_return", "budget"]


def in_table_2(frame: pd.DataFrame) -> "pd.Series[bool]":
    """Rows of the paper's main table: all but the decayed L2-squared variants of its appendix, which its
    correlation matrix leaves out.
    """
    return ~frame["variant"].str.fullmatch(r"decay.*_l2sq")


def correlations(rows: pd.DataFrame, level: str, random: np.random.Generator) -> pd.DataFrame:
    """Full matrices (both methods) over `CORRELATED`, long form: method, x, y, r, ci_low, ci_high, n, level.

    `rows` are cells, resampled as cells, unless `level` starts with "runs": then they are runs, resampled
    inside their cells (`stats.correlation`).
    """
    strata = rows.groupby(KEY).ngroup().to_numpy() if level.startswith("runs") else None
    records = []
    for method in stats.CORRELATIONS:
        for i, x in enumerate(CORRELATED):
            for y in CORRELATED[i:]:
                r, (low, high), n = stats.correlation(rows[x], rows[y], random, method, strata)
                pairs = [(x, y)] if x == y else [(x, y), (y, x)]
                records += [(method, *pair, r, low, high, n, level) for pair in pairs]
    return pd.DataFrame(records, columns=["method", "x", "y", "r", "ci_low", "ci_high", "n", "level"])


def correlation_frame(runs: pd.DataFrame, root_seed: int) -> pd.DataFrame:
    """`correlation.csv`: the matrices of each protocol at four levels, with `protocol` as last column.

    | level | rows |
    |---|---|
    | cells | means over seeds of the cells in the paper's main table: what its Fig. 3 correlates |
    | runs | the single runs of those cells |
    | cells_all, runs_all | the same with the appendix's cells |
    """
    parts = []
    for protocol, own in runs.groupby("protocol"):
        for suffix, chosen in (("", own[in_table_2(own)]), ("_all", own)):
            cells = chosen.groupby(KEY, as_index=False)[["success_rate", "mean_return"]].mean()
            for level, rows in (("cells", cells), ("runs", chosen)):
                name = level + suffix
                parts.append(correlations(rows, name, generator(root_seed, protocol, name)).assign(protocol=protocol))
    return pd.concat(parts, ignore_index=True)
