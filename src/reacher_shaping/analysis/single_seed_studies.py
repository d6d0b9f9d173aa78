"""What one seed can show: the paper's headline statements in many single-seed studies.

The paper has one unseeded run per cell. Here such studies are drawn from ours, one run of each of its 17
cells, independently, and the paper's own reading is applied to each: no intervals, the larger number wins.
How often a statement comes out says how much it is worth when it is made from one such study.
"""

from collections.abc import Callable

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from reacher_shaping import stats
from reacher_shaping.analysis.claim_formulas import BEST, LONG, SHAPED, SHORT, TABLE_2
from reacher_shaping.labels import CELL
from reacher_shaping.paper_variants import VARIANTS

Array = NDArray[np.float64]
CORRELATIONS = ["r_alpha_return", "r_success_return", "r_success_budget"]
INDEX = {cell: column for column, cell in enumerate(TABLE_2)}
NONE = {budget: INDEX["none", budget, 1.0] for budget in (SHORT, LONG)}
SHAPED_COLUMNS = [INDEX[cell] for cell in SHAPED]
BASELINES = [NONE[cell[1]] for cell in SHAPED]
DECAYED = [column for cell, column in INDEX.items() if VARIANTS[cell[0]].schedule == "linear"]
HALF = [INDEX[cell] for cell in SHAPED if cell[2] == 0.5]
FULL = [INDEX[cell[0], SHORT, 1.0] for cell in SHAPED if cell[2] == 0.5]


def _gain(success: Array, variant: str) -> Array:
    return success[:, INDEX[variant, LONG, 1.0]] - success[:, INDEX[variant, SHORT, 1.0]]


# Statement -> which studies [B] it comes out in, given success rates [B, 17].
STATEMENTS: dict[str, Callable[[Array], NDArray[np.bool_]]] = {
    "decay300k at 1M is the best cell": lambda s: s.argmax(axis=1) == INDEX[BEST],
    "a decayed cell is the best": lambda s: np.isin(s.argmax(axis=1), DECAYED),
    "no shaping is the best": lambda s: np.isin(s.argmax(axis=1), list(NONE.values())),
    "the best cell more than doubles `none` at 1M": lambda s: s.max(axis=1) > 2 * s[:, NONE[LONG]],
    "13 or more of 15 shaped cells are above `none`": lambda s: (
        (s[:, SHAPED_COLUMNS] > s[:, BASELINES]).sum(axis=1) >= 13
    ),
    "alpha0 = 0.5 is lower than 1 on average": lambda s: s[:, HALF].mean(axis=1) < s[:, FULL].mean(axis=1),
    "l2 gains from 500K to 1M while l2sq declines": lambda s: (_gain(s, "l2") > 0) & (_gain(s, "l2sq") < 0),
    "the five best cells are above 20 %": lambda s: np.sort(s, axis=1)[:, -5] > 0.2,
    "`none` hardly changes (2 points) from 500K to 1M": lambda s: np.abs(_gain(s, "none")) <= 0.02,
}


def single_seed_studies(runs: pd.DataFrame, random: np.random.Generator, studies: int = 10_000) -> pd.DataFrame:
    """Draw studies with one run per cell of Table 2, from the runs of one protocol. A row per study.

    Columns: `best_variant, best_budget, best_alpha0, best_success, ratio` (best over `none` at 1M), the correlations
    `CORRELATIONS`, and a boolean column per statement. Empty if a cell has no finished run.
    """
    columns = ["best_variant", "best_budget", "best_alpha0", "best_success", "ratio", *CORRELATIONS, *STATEMENTS]
    known = runs.dropna(subset=["success_rate", "mean_return"]).sort_values("seed")
    found = dict(iter(known.groupby(CELL)))
    if not set(TABLE_2) <= set(found):
        return pd.DataFrame(columns=columns)
    drawn = []
    for cell in TABLE_2:
        values = found[cell][["success_rate", "mean_return"]].to_numpy()
        drawn.append(values[random.integers(0, len(values), studies)])
    success, back = np.moveaxis(np.stack(drawn, axis=1), 2, 0)
    best = success.argmax(axis=1)
    none = success[:, NONE[LONG]]
    alpha0, budget = (np.broadcast_to([float(cell[i]) for cell in TABLE_2], success.shape) for i in (2, 1))
    frame = pd.DataFrame([TABLE_2[i] for i in best], columns=columns[:3])
    frame["best_success"] = success.max(axis=1)
    frame["ratio"] = np.divide(frame["best_success"], none, out=np.full(studies, np.nan), where=none > 0)
    pairs = [(alpha0, back), (success, back), (success, budget)]
    for name, (x, y) in zip(CORRELATIONS, pairs, strict=True):
        frame[name] = stats.pearson(x, y)
    for statement, holds in STATEMENTS.items():
        frame[statement] = holds(success)
    return frame


def lottery_frame(studies: pd.DataFrame) -> pd.DataFrame:
    """Share of studies in which each statement comes out: statement, share."""
    shares = [(statement, float(studies[statement].mean()) if len(studies) else np.nan) for statement in STATEMENTS]
    return pd.DataFrame(shares, columns=["statement", "share"])


def winners_frame(studies: pd.DataFrame) -> pd.DataFrame:
    """How often each cell is the best of a single-seed study: variant, budget, alpha0, share, most often first."""
    key = ["best_variant", "best_budget", "best_alpha0"]
    shares = studies.groupby(key).size().div(max(len(studies), 1)).rename("share").reset_index()
    return shares.rename(columns=lambda name: name.removeprefix("best_")).sort_values(
        "share", ascending=False, ignore_index=True
    )


def spread_frame(studies: pd.DataFrame) -> pd.DataFrame:
    """Quantiles over studies of what a single-seed study reports: quantity, q05, q25, q50, q75, q95."""
    quantities = ["best_success", "ratio", *CORRELATIONS]
    levels = [0.05, 0.25, 0.5, 0.75, 0.95]
    names = [f"q{round(100 * level):02d}" for level in levels]
    table = studies[quantities].astype(float).quantile(levels).T
    return table.set_axis(names, axis=1).rename_axis("quantity").reset_index()
