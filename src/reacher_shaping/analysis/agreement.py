"""Whether two runs of the study agree, cell by cell."""

import pandas as pd

from reacher_shaping import stats
from reacher_shaping.labels import KEY

COMPARED = ("success_rate", "mean_return")
LEVEL = 0.05


def compare(runs: pd.DataFrame, reference: pd.DataFrame) -> pd.DataFrame:
    """Set two runs of a study side by side: a row per common cell and metric, ours less the reference.

    The seeds of the two may differ, so the difference of means has Welch's interval, and its p value is
    Holm-corrected over all rows. Columns: the cell's key, metric, ours, reference, difference, ci_low, ci_high, p,
    p_holm; p is NaN with fewer than two seeds on a side, and 1 where the runs are the same.
    """
    by_cell = dict(iter(reference.groupby(KEY)))
    rows = []
    for key, own in runs.groupby(KEY):
        if key not in by_cell:
            continue
        for metric in COMPARED:
            ours, theirs = (stats.finite(frame[metric]) for frame in (own, by_cell[key]))
            low, high = stats.welch_interval(ours, theirs)
            difference = stats.mean(ours) - stats.mean(theirs)
            values = (stats.mean(ours), stats.mean(theirs), difference, low, high, stats.welch_p(ours, theirs))
            rows.append((*key, metric, *values))
    columns = [*KEY, "metric", "ours", "reference", "difference", "ci_low", "ci_high", "p"]
    frame = pd.DataFrame(rows, columns=columns)
    return frame.assign(p_holm=stats.holm(frame["p"].to_numpy(dtype=float)))


def agreement(compared: pd.DataFrame) -> str:
    """Say in one line whether two runs agree beyond seed noise."""
    tested = compared.dropna(subset="p_holm")
    if tested.empty:
        return "Cannot tell: no cell has two seeds in both runs."
    apart = tested[tested["p_holm"] < LEVEL]
    cells = len(tested.groupby(KEY))
    if apart.empty:
        return f"The runs agree: none of {cells} cells differs beyond seed noise (Welch, Holm-corrected, 5 %)."
    names = ", ".join("/".join(str(part) for part in key) for key, _ in apart.groupby(KEY))
    return f"The runs differ beyond seed noise in {len(apart.groupby(KEY))} of {cells} cells: {names}."


def compare_verdicts(claims: pd.DataFrame, reference: pd.DataFrame) -> pd.DataFrame:
    """Set the verdicts of two studies side by side: id, ours, reference, same, replication.

    The verdicts are those of the intervals, `replication` the reference's chance that another study comes to its own.
    Claims that either could not test are left out.
    """
    both = claims.merge(reference, on="id", suffixes=("", "_reference"))
    frame = both[["id", "interval_verdict", "interval_verdict_reference", "replication_reference"]]
    frame = frame.set_axis(["id", "ours", "reference", "replication"], axis=1)
    frame = frame[(frame[["ours", "reference"]] != "untestable").all(axis=1)]
    return frame.assign(same=frame["ours"] == frame["reference"]).reset_index(drop=True)


def verdicts_agree(compared: pd.DataFrame) -> str:
    """Say in one line how many verdicts came out again, and how many were to be expected to."""
    if compared.empty:
        return "No claim is tested in both."
    apart = compared.loc[~compared["same"], "id"].to_list()
    expected = compared["replication"].sum()
    text = f"Of {len(compared)} verdicts {compared['same'].sum()} are the same, {expected:.1f} were to be expected."
    return f"{text} Others: {', '.join(apart)}." if apart else text
