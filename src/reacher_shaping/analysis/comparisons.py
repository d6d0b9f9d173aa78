"""Tables of what differs from what: paired comparisons, probability of improvement, variance, power.

Families, stated before any run; Holm's correction is over one family of one metric in one protocol:

| family | each comparison | asks |
|---|---|---|
| none | a shaped cell less `none` at the same budget | does shaping help? |
| constant | a decayed cell less its constant potential, same budget and alpha0 | does decay help? |
| longer | a cell at its larger budget less the same at the smaller one | does training longer help? |
| half | a cell at alpha0 = 0.5 less the same at 1 | does a weaker start hurt? |

With n paired seeds the smallest exact sign-flip p is 2 / 2^n: 0.002 for ten. A family of more than 25
comparisons could then never be significant after Holm, which is why not every pair of cells is compared.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from reacher_shaping import stats
from reacher_shaping.analysis import learning_curves
from reacher_shaping.analysis.runs import Block, curve_array
from reacher_shaping.labels import CELL, KEY
from reacher_shaping.random_streams import generator

METRICS = ("success_rate", "mean_return", "final_success_rate", "final_distance")
SPEED = ("area_under_curve",)
"""Learning speed, compared in the further studies. Steps to a threshold would leave out runs that never get there."""
FAMILIES = ("none", "constant", "longer", "half")


def partner(family: str, key: Mapping[str, Any], cells: pd.DataFrame) -> dict[str, Any] | None:
    """Key of the cell that `key` is compared with in a family; None if it takes no part. May not exist."""
    own, variant = dict(key), str(key["variant"])
    if family == "none" and variant != "none":
        labelled = own | {"variant": "none"}  # where alpha0 is a label, the baseline has it too
        there = (cells[KEY] == pd.Series(labelled)).all(axis=1).any()
        return labelled if there else labelled | {"alpha0": 1.0}
    if family == "constant" and variant.startswith("decay"):
        return own | {"variant": "l2sq" if variant.endswith("_l2sq") else "l2"}
    if family == "half" and key["alpha0"] == 0.5:
        return own | {"alpha0": 1.0}
    if family == "longer":
        rest = [name for name in KEY if name != "budget"]
        budgets = cells.loc[(cells[rest] == pd.Series({name: own[name] for name in rest})).all(axis=1), "budget"]
        if key["budget"] == budgets.max() != budgets.min():
            return own | {"budget": budgets.min()}
    return None


def comparison_frame(runs: pd.DataFrame, root_seed: int, metrics: Sequence[str] = METRICS) -> pd.DataFrame:
    """A row per metric and comparison of the families above, paired on common seeds.

    Columns: family, metric, the cell's key, `other_variant, other_budget, other_alpha0`, difference, ci_low,
    ci_high, p, p_holm, improvement (probability that a run of the cell beats one of the other; for
    `final_distance` smaller is better), improvement_low, improvement_high, seeds.
    """
    cells = runs[KEY].drop_duplicates()
    by_cell = {tuple(key): own.set_index("seed") for key, own in runs.groupby(KEY)}
    rows = []
    for family in FAMILIES:
        for values in cells.itertuples(index=False, name=None):
            key = dict(zip(KEY, values, strict=True))
            other = partner(family, key, cells)
            if other is None or tuple(other[name] for name in KEY) not in by_cell:
                continue
            ours, theirs = (by_cell[tuple(which[name] for name in KEY)] for which in (key, other))
            named = {f"other_{name}": other[name] for name in KEY[1:]}
            for metric in metrics:
                random = generator(root_seed, family, *key.values(), metric)
                compared = _compare(
                    ours[metric], theirs[metric], random, better=-1 if metric.endswith("distance") else 1
                )
                rows.append({"family": family, "metric": metric} | key | named | compared)
    columns = ["family", "metric", *KEY, "other_variant", "other_budget", "other_alpha0", *COMPARED]
    frame = pd.DataFrame(rows, columns=[name for name in columns if name != "p_holm"])
    families = frame.groupby(["protocol", "family", "metric"])["p"]
    frame["p_holm"] = families.transform(stats.holm) if len(frame) else pd.Series(dtype=float)
    return frame[columns]


COMPARED = [
    "difference",
    "ci_low",
    "ci_high",
    "p",
    "p_holm",
    "improvement",
    "improvement_low",
    "improvement_high",
    "seeds",
]


def _compare(
    ours: "pd.Series[float]", theirs: "pd.Series[float]", random: np.random.Generator, better: int
) -> dict[str, float]:
    """One comparison of two cells' runs, indexed by seed; `better` is the sign of an improvement."""
    ours, theirs = ours.align(theirs, join="inner")
    found = stats.paired_comparison(ours, theirs, random)
    chance, (low, high) = stats.probability_of_improvement(better * ours, better * theirs, random)
    values = (*found[:4], chance, low, high, found.seeds)
    return dict(zip([name for name in COMPARED if name != "p_holm"], values, strict=True))


def variance_frame(runs: pd.DataFrame) -> pd.DataFrame:
    """Variance of the success rate over the seeds of each cell: key, seeds, seed_variance, evaluation_variance."""
    rows = []
    for key, own in runs.groupby(KEY):
        seed, evaluation = stats.variance_split(own["success_rate"], int(own["episodes"].median()))
        row = dict(zip(KEY, key, strict=True)) | {"seeds": len(own)}
        rows.append(row | {"seed_variance": seed, "evaluation_variance": evaluation})
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
