"""Tables of what differs from what: paired comparisons, probability of improvement, variance, power.

Families, stated before any run; Holm's correction is over one family of one metric in one protocol:

| family | each comparison | asks |
|---|---|---|
| none | a shaped cell less `none` at the same budget | does shaping help? |
| constant | a decayed cell less its constant potential, same budget and alpha0 | does decay help? |
| longer | a cell at its larger budget less the same at the smaller one | does training longer help? |
| half | a cell at alpha0 = 0.5 less the same at 1 | does a weaker start hurt? |
| squared | a cell of an L2-squared potential less the same of L2 | which potential learns better? |

A difference has a t interval over common seeds, and one that holds for its whole family at once (Bonferroni): the
best of a family is picked for its luck too, and only the latter holds for it.
"""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from reacher_shaping import stats
from reacher_shaping.analysis import learning_curves
from reacher_shaping.analysis.runs import Block, curve_array
from reacher_shaping.labels import CELL, KEY

METRICS = ("success_rate", "mean_return", "final_success_rate", "final_distance")
SPEED = ("area_under_curve",)
"""Learning speed, compared in the further studies. Steps to a threshold would leave out runs that never get there."""
FAMILIES = ("none", "constant", "longer", "half", "squared")


def partner(family: str, key: Mapping[Any, Any], cells: pd.DataFrame) -> dict[str, Any] | None:
    """Key of the cell that `key` is compared with in a family; None if it takes no part. May not exist."""
    own, variant = dict(key), str(key["variant"])
    if family == "none" and variant != "none":
        labelled = own | {"variant": "none"}  # where alpha0 is a label, the baseline has it too
        there = (cells[KEY] == pd.Series(labelled)).all(axis=1).any()
        return labelled if there else labelled | {"alpha0": 1.0}
    if family == "constant" and variant.startswith("decay"):
        return own | {"variant": "l2sq" if variant.endswith("_l2sq") else "l2"}
    if family == "squared" and variant.endswith("l2sq"):
        return own | {"variant": "l2" if variant == "l2sq" else variant.removesuffix("_l2sq")}
    if family == "half" and key["alpha0"] == 0.5:
        return own | {"alpha0": 1.0}
    if family == "longer":
        rest = [name for name in KEY if name != "budget"]
        budgets = cells.loc[(cells[rest] == pd.Series({name: own[name] for name in rest})).all(axis=1), "budget"]
        if key["budget"] == budgets.max() != budgets.min():
            return own | {"budget": budgets.min()}
    return None


def comparison_frame(runs: pd.DataFrame, metrics: Sequence[str] = METRICS) -> pd.DataFrame:
    """A row per metric and comparison of the families above, paired on common seeds.

    Columns: family, metric, the cell's key, `other_variant, other_budget, other_alpha0`, difference, ci_low, ci_high,
    p, p_holm, improvement (probability that a run of the cell beats one of the other; for `final_distance` smaller is
    better), improvement_low, improvement_high, seeds, family_low, family_high (limits of the difference that hold for
    all comparisons of the family and metric at once).
    """
    cells = runs[KEY].drop_duplicates()
    by_cell = {tuple(key): own.set_index("seed") for key, own in runs.groupby(KEY)}
    rows = []
    for family in FAMILIES:
        pairs = [(key, other) for key in cells.to_dict("records") if (other := partner(family, key, cells))]
        pairs = [pair for pair in pairs if tuple(pair[1][name] for name in KEY) in by_cell]
        sizes = Counter(key["protocol"] for key, _ in pairs)
        for key, other in pairs:
            ours, theirs = (by_cell[tuple(which[name] for name in KEY)] for which in (key, other))
            named = {name: key[name] for name in KEY} | {f"other_{name}": other[name] for name in KEY[1:]}
            for metric in metrics:
                better = -1 if metric.endswith("distance") else 1
                compared = _compare(ours[metric], theirs[metric], better, among=sizes[key["protocol"]])
                rows.append({"family": family, "metric": metric} | named | compared)
    columns = ["family", "metric", *KEY, "other_variant", "other_budget", "other_alpha0", *COMPARED]
    frame = pd.DataFrame(rows, columns=[name for name in columns if name != "p_holm"])
    return stats.with_holm(frame, ["protocol", "family", "metric"])


COMPARED = [
    *("difference", "ci_low", "ci_high", "p", "p_holm", "improvement", "improvement_low", "improvement_high"),
    *("seeds", "family_low", "family_high"),
]


def _compare(ours: "pd.Series[float]", theirs: "pd.Series[float]", better: int, among: int) -> dict[str, float]:
    """One comparison of two cells' runs, indexed by seed, `among` those of a family.

    `better` is the sign of an improvement.
    """
    ours, theirs = ours.align(theirs, join="inner")
    found = stats.paired_comparison(ours, theirs)
    family = stats.paired_comparison(ours, theirs, level=1 - (1 - stats.LEVEL) / among)
    chance, (low, high) = stats.probability_of_improvement(better * ours, better * theirs)
    values = (*found[:4], chance, low, high, found.seeds, family.low, family.high)
    return dict(zip([name for name in COMPARED if name != "p_holm"], values, strict=True))


def variance_frame(runs: pd.DataFrame) -> pd.DataFrame:
    """Variance of the success rate over the seeds of each cell.

    Columns: the key, seeds, seed_variance, evaluation_variance, resets_deviation. The last bounds what the intervals
    leave out: every run meets the same resets, and other resets would move all rates of a cell together, by at most
    the binomial error sqrt(p (1 - p) / E).
    """
    rows = []
    for key, own in runs.groupby(KEY):
        episodes = int(own["episodes"].median())
        seed, evaluation = stats.variance_split(own["success_rate"], episodes)
        row = dict(zip(KEY, key, strict=True)) | {"seeds": len(own)}
        row |= {"seed_variance": seed, "evaluation_variance": evaluation}
        rate = stats.mean(own["success_rate"])
        rows.append(row | {"resets_deviation": np.sqrt(rate * (1 - rate) / episodes) if episodes else np.nan})
    return pd.DataFrame(rows)


def power_frame(runs: pd.DataFrame, published: pd.DataFrame) -> pd.DataFrame:
    """How many seeds would tell the published gain of each shaped cell over `none` from chance.

    `published`: `variant, budget, alpha0, success_rate`. Columns: the key, published_gain, deviation (of our
    paired differences), seeds, power (with those seeds), power_3, seeds_needed (80 % power, paired t test at 5 %).
    """
    theirs = published.set_index(CELL)["success_rate"].to_dict()
    rates = {tuple(key): own.set_index("seed")["success_rate"] for key, own in runs.groupby(KEY)}
    columns = [*KEY, "published_gain", "deviation", "seeds", "power", "power_3", "seeds_needed"]
    rows = []
    for (protocol, *cell), ours in rates.items():
        none = ("none", cell[1], 1.0)
        if cell[0] == "none" or (protocol, *none) not in rates or not {tuple(cell), none} <= theirs.keys():
            continue
        gain = theirs[tuple(cell)] - theirs[none]
        differences = stats.finite(ours - rates[protocol, *none])
        deviation = float(differences.std(ddof=1)) if differences.size > 1 else float("nan")
        powers = [stats.power(gain, deviation, seeds) for seeds in (differences.size, 3)]
        needed = stats.seeds_needed(gain, deviation)
        rows.append((protocol, *cell, gain, deviation, differences.size, *powers, needed))
    return pd.DataFrame(rows, columns=columns)


def roughness_stability(blocks: Iterable[Block]) -> pd.DataFrame:
    """Does roughness depend on smoothing? Rank correlation over runs of each window with no smoothing.

    Columns: protocol, window (iterations), spearman, runs. Near 1: the order of the runs does not hang on the window.
    """
    parts: dict[str, list[np.ndarray[Any, Any]]] = {}
    for key, progress, _ in blocks:
        curves = curve_array(progress).to_numpy(dtype=float)
        parts.setdefault(key["protocol"], []).append(learning_curves.roughness_by_window(curves))
    rows = []
    for protocol, found in parts.items():
        table = np.concatenate(found)
        for column, window in enumerate(learning_curves.WINDOWS):
            r = float(stats.spearman(table[:, 0], table[:, column]))
            rows.append((protocol, window, r, int(np.isfinite(table[:, column]).sum())))
    return pd.DataFrame(rows, columns=["protocol", "window", "spearman", "runs"])


def only_cell(shaped: pd.DataFrame) -> bool:
    """Whether comparisons to `none` are all of one shaped cell."""
    return len(shaped) == shaped["metric"].nunique()


def corrected(shaped: pd.DataFrame, metrics: Collection[str]) -> pd.DataFrame:
    """The comparisons that are shown; of an only shaped cell the measures are the family, elsewhere its cells are."""
    measured = shaped[shaped["metric"].isin(metrics)]
    return measured.assign(p_holm=stats.holm(measured["p"].to_numpy())) if only_cell(shaped) else measured
