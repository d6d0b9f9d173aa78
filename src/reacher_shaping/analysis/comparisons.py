"""Tables of what differs from what: paired comparisons, probability of improvement, variance, power.

Families, stated before any run; Holm's correction is over one family of one metric in one protocol. Cells that the
paper has and others are families of their own, so that a cell that is added changes nothing of the paper's:

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
from reacher_shaping.labels import CELL, DESIGN, KEY

METRICS = ("success_rate", "mean_return", "final_success_rate", "final_distance")
SPEED = ("area_under_curve",)
"""Learning speed, compared in the further studies. Steps to a threshold would leave out runs that never get there."""
FAMILIES = ("none", "constant", "longer", "half", "squared")


def partner(family: str, cell: Mapping[Any, Any], cells: pd.DataFrame) -> dict[str, Any] | None:
    """Key of the cell that `cell` is compared with in a family; None if it takes no part. May not exist.

    `cell` and `cells` hold the key, `potential`, `schedule` and `horizon`.
    """
    own = {name: cell[name] for name in KEY}
    shaped = cell["potential"] != "none"
    if family == "none" and shaped:
        labelled = own | {"variant": "none"}  # where alpha0 is a label, the baseline has it too
        there = (cells[KEY] == pd.Series(labelled)).all(axis=1).any()
        return labelled if there else labelled | {"alpha0": 1.0}
    if family == "constant" and shaped and cell["schedule"] != "constant":
        return _other_variant(own, cells, potential=cell["potential"], schedule="constant")
    if family == "squared" and cell["potential"] == "l2sq":
        return _other_variant(own, cells, potential="l2", schedule=cell["schedule"], horizon=cell["horizon"])
    if family == "half" and cell["alpha0"] == 0.5:
        return own | {"alpha0": 1.0}
    if family == "longer":
        rest = [name for name in KEY if name != "budget"]
        budgets = cells.loc[(cells[rest] == pd.Series({name: own[name] for name in rest})).all(axis=1), "budget"]
        if cell["budget"] == budgets.max() != budgets.min():
            return own | {"budget": budgets.min()}
    return None


def _other_variant(own: dict[str, Any], cells: pd.DataFrame, **design: Any) -> dict[str, Any] | None:
    """Key of the cell that differs from `own` by a variant of this design; None where there is none."""
    wanted = {name: value for name, value in own.items() if name != "variant"} | design
    for name, value in wanted.items():
        cells = cells[cells[name].isna() if pd.isna(value) else cells[name] == value]
    return None if cells.empty else own | {"variant": cells["variant"].iloc[0]}


def comparison_frame(runs: pd.DataFrame, metrics: Sequence[str] = METRICS) -> pd.DataFrame:
    """A row per metric and comparison of the families above, paired on common seeds.

    Columns: family, metric, the cell's key, `other_variant, other_budget, other_alpha0`, difference, ci_low, ci_high,
    p, p_holm, improvement (probability that a run of the cell beats one of the other; for `final_distance` smaller is
    better), improvement_low, improvement_high, seeds, family_low, family_high (limits of the difference that hold for
    all comparisons of the family and metric at once), group (of the cell).
    """
    cells = runs[[*KEY, *DESIGN]].drop_duplicates()
    paper = cells[cells["group"] != "extra"]
    by_cell = {tuple(key): own.set_index("seed") for key, own in runs.groupby(KEY)}
    rows = []
    for family in FAMILIES:
        asked = [(key, cells if key["group"] == "extra" else paper) for key in cells.to_dict("records")]
        pairs = [(key, other) for key, among in asked if (other := partner(family, key, among))]
        pairs = [pair for pair in pairs if tuple(pair[1][name] for name in KEY) in by_cell]
        sizes = Counter((key["protocol"], key["group"] == "extra") for key, _ in pairs)
        for key, other in pairs:
            ours, theirs = (by_cell[tuple(which[name] for name in KEY)] for which in (key, other))
            among = sizes[key["protocol"], key["group"] == "extra"]
            named = {name: key[name] for name in KEY} | {f"other_{name}": other[name] for name in KEY[1:]}
            for metric in metrics:
                better = -1 if metric.endswith("distance") else 1
                compared = _compare(ours[metric], theirs[metric], better, among)
                rows.append({"family": family, "metric": metric} | named | compared | {"group": key["group"]})
    columns = ["family", "metric", *KEY, "other_variant", "other_budget", "other_alpha0", *COMPARED, "group"]
    frame = pd.DataFrame(rows, columns=[name for name in columns if name != "p_holm"])
    frame["extra"] = frame["group"] == "extra"
    return stats.with_holm(frame, ["protocol", "family", "metric", "extra"]).drop(columns="extra")


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
    return pd.DataFrame(rows, columns=[*KEY, "seeds", "seed_variance", "evaluation_variance", "resets_deviation"])


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


def median_seeds_needed(power: pd.DataFrame) -> float:
    """The seeds that the median of these cells of `power_frame` takes; infinite where no number of seeds helps it."""
    return float(power["seeds_needed"].fillna(np.inf).median())


def seed_shares(variance: pd.DataFrame) -> "pd.Series[float]":
    """The seeds' share of the variance of each cell of `variance_frame`, 0 to 1; missing where there is none."""
    total = variance["seed_variance"] + variance["evaluation_variance"]
    return (variance["seed_variance"] / total).where(total > 0)


def extent(values: "pd.Series[float]") -> tuple[float, float, float]:
    """The least of the known values, their median, and the greatest."""
    low, middle, high = values.quantile([0.0, 0.5, 1.0])
    return float(low), float(middle), float(high)


def mean_difference(compared: pd.DataFrame) -> float:
    """Mean over rows of `comparison_frame`."""
    return float(compared["difference"].mean())


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
