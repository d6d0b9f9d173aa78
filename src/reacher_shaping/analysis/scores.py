"""Robust averages over runs and the whole distribution of them (Agarwal et al. 2021, arXiv:2108.13264)."""

import numpy as np
import pandas as pd

from reacher_shaping import stats
from reacher_shaping.analysis.comparisons import partner
from reacher_shaping.analysis.correlation import in_paper
from reacher_shaping.labels import DESIGN, KEY

METRICS = ("success_rate", "final_success_rate", "mean_return")
THRESHOLDS = tuple(round(0.02 * step, 2) for step in range(51))


def scores_frame(runs: pd.DataFrame) -> pd.DataFrame:
    """`scores.parquet`: a row per cell and metric, t and jackknife intervals over seeds.

    Columns: the key, metric, seeds, mean, mean_low, mean_high, iqm (interquartile mean), iqm_low, iqm_high, improvement
    (chance that a run beats one of `none` at the same budget), improvement_low, improvement_high; the last three are
    missing for `none` and where there is no such cell.
    """
    cells = runs[[*KEY, *DESIGN]].drop_duplicates()
    design = {tuple(cell[name] for name in KEY): cell for cell in cells.to_dict("records")}
    by_cell = {tuple(key): own.set_index("seed") for key, own in runs.groupby(KEY)}
    rows = []
    for key, own in by_cell.items():
        other = partner("none", design[key], cells)
        none = by_cell.get(tuple(other[name] for name in KEY)) if other else None
        for metric in METRICS:
            sample = own[metric]
            chance, limits = float("nan"), stats.NO_INTERVAL
            if none is not None:
                chance, limits = stats.probability_of_improvement(*sample.align(none[metric], join="inner"))
            averages = (stats.mean(sample), *stats.t_interval(sample), stats.iqm(sample), *stats.iqm_interval(sample))
            rows.append((*key, metric, len(own), *averages, chance, *limits))
    names = [f"{name}{end}" for name in ("mean", "iqm", "improvement") for end in ("", "_low", "_high")]
    return pd.DataFrame(rows, columns=[*KEY, "metric", "seeds", *names])


def profiles_frame(runs: pd.DataFrame) -> pd.DataFrame:
    """`profiles.parquet`: share of the runs of a kind of variants whose success is above a threshold.

    The paper's cells alone count. In `kind`: `none`, `constant`, `decay`, or `decay_l2sq`, the appendix's.
    Columns: protocol, kind, budget, threshold, seeds, share, share_low, share_high. A seed's share is over the kind's
    cells, so the limits are t limits over seeds, ending at 0 and 1.
    """
    paper = runs[in_paper(runs)]
    kinds = [paper["variant"] == "none", paper["schedule"] == "constant", paper["group"] == "appendix"]
    named = paper.assign(kind=np.select(kinds, ["none", "constant", "decay_l2sq"], "decay"))
    rows = []
    for key, own in named.groupby(["protocol", "kind", "budget"]):
        for threshold in THRESHOLDS:
            share = (own["success_rate"] > threshold).groupby(own["seed"]).mean()
            low, high = np.clip(stats.t_interval(share), 0.0, 1.0)
            rows.append((*key, threshold, len(share), stats.mean(share), low, high))
    columns = ["protocol", "kind", "budget", "threshold", "seeds", "share", "share_low", "share_high"]
    return pd.DataFrame(rows, columns=columns)
