"""What each claim comes down to as numbers: formulas of a sample, and their values on a study.

A new estimate is one entry of `FORMULAS` and one rule in `report/claims.yaml`.

Axes: [K] jackknife rows (row 0: all seeds), [C]ell, [S]eed.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
import pandas as pd

from reacher_shaping import stats
from reacher_shaping.analysis.claim_estimates import Array, Cell, Estimate, MissingError, Sample
from reacher_shaping.analysis.runs import steps_or_budget
from reacher_shaping.labels import CELL
from reacher_shaping.paper_variants import VARIANTS, of_group

SHORT, LONG = 500_000, 1_000_000
BUDGETS = (SHORT, LONG)
CONSTANT, DECAYED = (
    tuple(name for name in of_group("main") if name != "none" and VARIANTS[name].schedule == schedule)
    for schedule in ("constant", "linear")
)
SHAPED: list[Cell] = [
    (variant, budget, alpha0)
    for budget, alpha0 in ((SHORT, 1.0), (LONG, 1.0), (SHORT, 0.5))
    for variant in CONSTANT + DECAYED
]
TABLE_2: list[Cell] = [("none", SHORT, 1.0), ("none", LONG, 1.0), *SHAPED]
TABLE_3: list[Cell] = [(variant, budget, 0.5) for variant in of_group("appendix") for budget in BUDGETS]
BEST: Cell = ("decay300k", LONG, 1.0)


PEERS, OFF_POLICY = "C19", ("sac", "td3")
LONG_EPISODES = "C14"

Formula = Callable[[Sample], Estimate]
Measured = dict[str, dict[str, Estimate]]


def success(s: Sample, cell: Cell) -> Array:
    """Success rate of a cell [K]."""
    return s.mean("success_rate", cell)


def over_none(s: Sample) -> Array:
    """Success of each shaped cell less that of `none` at the same budget [K, C]."""
    none = {budget: success(s, ("none", budget, 1.0)) for budget in BUDGETS}
    return np.stack([success(s, cell) - none[cell[1]] for cell in SHAPED], axis=1)


def wins_over_none(s: Sample) -> Array:
    """Share of the shaped runs that beat `none` of the same seed and budget, ties counted half [K]."""
    none = s.table("success_rate", [("none", cell[1], 1.0) for cell in SHAPED])
    ahead = s.table("success_rate", SHAPED) - none
    return s.average(((np.sign(ahead) + 1) / 2).mean(axis=1))


def best_over_others(s: Sample) -> Array:
    """Success of decay300k at 1M less that of each other cell of Table 2 [K, C]."""
    return success(s, BEST)[:, None] - s.means("success_rate", [cell for cell in TABLE_2 if cell != BEST])


def decayed_over_constant(s: Sample) -> Array:
    """Mean success of the decayed cells less that of the constant ones [K]."""
    decayed = s.means("success_rate", [cell for cell in SHAPED if cell[0] in DECAYED])
    constant = s.means("success_rate", [cell for cell in SHAPED if cell[0] in CONSTANT])
    difference: Array = decayed.mean(axis=1) - constant.mean(axis=1)
    return difference


def longer(s: Sample, *variants: str) -> Array:
    """Success at one million steps less success at half a million, alpha0 = 1 [K, C]."""
    long, short = (s.means("success_rate", [(v, budget, 1.0) for v in variants]) for budget in (LONG, SHORT))
    return long - short


def half_alpha_loss(s: Sample) -> Array:
    """Success at alpha0 = 1 less that at 0.5, mean over the shaped variants at 500K [K]."""
    variants = CONSTANT + DECAYED
    full, half = (s.means("success_rate", [(v, SHORT, alpha0) for v in variants]) for alpha0 in (1.0, 0.5))
    loss: Array = (full - half).mean(axis=1)
    return loss


def pooled_rank_correlation(s: Sample, metric: str) -> Array:
    """Spearman's correlation of success with a metric over all runs of Table 2 [K]."""
    return stats.spearman(s.runs(metric, TABLE_2), s.runs("success_rate", TABLE_2))


def rank_correlation_by_seed(s: Sample, metric: str) -> Array:
    """Spearman's correlation of success with a metric over the cells of one seed and budget, mean over both [K]."""
    budgets = [[cell for cell in TABLE_2 if cell[1] == budget] for budget in BUDGETS]
    by_budget = [stats.spearman(s.table(metric, cells), s.table("success_rate", cells)) for cells in budgets]
    return s.average(np.mean(by_budget, axis=0))


def cell_correlation(s: Sample, x: str, y: str) -> Array:
    """Pearson's correlation over the means of the cells of Table 2 [K]; `alpha0` and `budget` are the design's."""
    rate = s.means("success_rate", TABLE_2)
    design = {"budget": 1, "alpha0": 2}
    xs, ys = (
        np.broadcast_to([float(cell[design[name]]) for cell in TABLE_2], rate.shape)
        if name in design
        else s.means(name, TABLE_2)
        for name in (x, y)
    )
    return stats.pearson(xs, ys)


def mean_over(s: Sample, metric: str, cells: Sequence[Cell]) -> Array:
    """A metric's mean over cells [K]."""
    means: Array = s.means(metric, cells).mean(axis=1)
    return means


def ratio(over: Array, under: Array) -> Array:
    """One quantity over another [K]; NaN where the divisor is zero."""
    return over / np.where(under != 0, under, np.nan)


def steps_saved(s: Sample) -> Array:
    """Share of the steps to the threshold that shaped cells save against `none`, mean over cells [K]."""
    none = {budget: s.mean("timed", ("none", budget, 1.0)) for budget in BUDGETS}
    saved: Array = np.mean([1 - ratio(s.mean("timed", cell), none[cell[1]]) for cell in SHAPED], axis=0)
    return saved


def longer_episodes(s: Sample, metric: str) -> Array:
    """A metric of episodes of 500 steps over that of episodes of 50, means over the cells that have both [K]."""
    lengths = (f"{metric}_50", f"{metric}_500")
    cells = [cell for cell in TABLE_2 if all(s.has(length, cell) for length in lengths)]
    if not cells:
        raise MissingError("episodes of 50 and 500 steps")
    at_50, at_500 = (mean_over(s, length, cells) for length in lengths)
    return ratio(at_500, at_50)


NONE_SHORT, NONE_LONG = ("none", SHORT, 1.0), ("none", LONG, 1.0)
HALF_L2SQ = ("l2sq", SHORT, 0.5)
FORMULAS: dict[str, dict[str, Formula]] = {
    "C1": {
        "gain": lambda s: s.estimate(over_none(s).mean(axis=1)),
        "share": lambda s: s.share_above_zero(over_none(s)),
        "wins": lambda s: s.rate(wins_over_none(s)),
    },
    "C2": {"margin": lambda s: s.ranked(best_over_others(s), rank=len(TABLE_2) - 1)},
    "C3": {"difference": lambda s: s.estimate(decayed_over_constant(s))},
    "C4": {
        "contrast": lambda s: s.estimate(
            -pooled_rank_correlation(s, "roughness") - pooled_rank_correlation(s, "mean_return")
        ),
        "smoothness": lambda s: s.correlation(-pooled_rank_correlation(s, "roughness")),
        "contrast_by_seed": lambda s: s.estimate(
            -rank_correlation_by_seed(s, "shaking") - rank_correlation_by_seed(s, "mean_return")
        ),
        "smoothness_by_seed": lambda s: s.estimate(-rank_correlation_by_seed(s, "shaking")),
    },
    "C5": {
        "short": lambda s: s.rate(success(s, NONE_SHORT)),
        "long": lambda s: s.rate(success(s, NONE_LONG)),
        "change": lambda s: s.estimate(success(s, NONE_LONG) - success(s, NONE_SHORT)),
    },
    "C6": {
        "early": lambda s: s.rate(mean_over(s, "early_peak", TABLE_2)),
        "lost": lambda s: s.rate(mean_over(s, "lost", TABLE_2)),
    },
    "C7": {
        "long": lambda s: s.rate(success(s, BEST)),
        "short": lambda s: s.rate(success(s, ("decay300k", SHORT, 1.0))),
    },
    "C8": {
        "largest": lambda s: s.ranked(longer(s, "none", *CONSTANT, *DECAYED), rank=1),
        "smallest": lambda s: s.ranked(longer(s, "none", *CONSTANT, *DECAYED), rank=6),
    },
    "C9": {"loss": lambda s: s.estimate(half_alpha_loss(s))},
    "C10": {
        "alpha_return": lambda s: s.correlation(cell_correlation(s, "alpha0", "mean_return")),
        "success_return": lambda s: s.correlation(cell_correlation(s, "success_rate", "mean_return")),
        "success_budget": lambda s: s.correlation(cell_correlation(s, "success_rate", "budget")),
    },
    "C11": {
        "ratio": lambda s: s.estimate(ratio(s.mean("mean_return", HALF_L2SQ), s.mean("mean_return", NONE_SHORT))),
        "gain": lambda s: s.estimate(success(s, HALF_L2SQ) - success(s, NONE_SHORT)),
    },
    "C12": {
        "contrast": lambda s: s.estimate(longer(s, "l2")[:, 0] - longer(s, "l2sq")[:, 0]),
        "l2": lambda s: s.estimate(longer(s, "l2")[:, 0]),
        "l2sq": lambda s: s.estimate(longer(s, "l2sq")[:, 0]),
    },
    "C13": {"ratio": lambda s: s.estimate(ratio(success(s, BEST), success(s, NONE_LONG)))},
    "C14": {
        "ratio": lambda s: s.estimate(longer_episodes(s, "final_distance")),
        "held": lambda s: s.estimate(longer_episodes(s, "share_within_radius")),
    },
    "C15": {
        "ratio": lambda s: s.estimate(
            ratio(mean_over(s, "final_return", TABLE_3), mean_over(s, "peak_return", TABLE_3))
        ),
        "peak_iteration": lambda s: s.estimate(mean_over(s, "peak_iteration", TABLE_3)),
    },
    "C16": {
        "fifth": lambda s: s.ranked(s.means("success_rate", TABLE_2), rank=5),
        "over_untrained": lambda s: s.ranked(s.means("success_rate", TABLE_2) - s.untrained, rank=5),
    },
    "C17": {"saved": lambda s: s.estimate(steps_saved(s))},
    "C18": {"success": lambda s: s.rate(success(s, NONE_LONG))},
}
"""The estimates of each claim that are made of this study's own runs, by claim and name."""


def off_policy_gain(peers: pd.DataFrame, algorithm: str, level: float = stats.LEVEL) -> Estimate:
    """Success of an off-policy algorithm less that of PPO (C19), Welch's interval. Raises MissingError.

    `peers` has `algorithm` (PPO, SAC, TD3) and `success_rate`, a row per run.
    """
    names = peers["algorithm"].str.lower()
    theirs, ppo = (stats.finite(peers.loc[names == name, "success_rate"]) for name in (algorithm, "ppo"))
    if not theirs.size or not ppo.size:
        raise MissingError(f"{algorithm} and ppo among the peers")
    fewest = min(theirs.size, ppo.size)
    errors = [sample.var(ddof=1) / sample.size if sample.size > 1 else np.nan for sample in (theirs, ppo)]
    interval = stats.welch_interval(theirs, ppo, level)
    return Estimate(stats.mean(theirs) - stats.mean(ppo), *interval, fewest, float(np.sqrt(sum(errors))))


@dataclass(frozen=True)
class Study:
    """What the claims are judged on.

    runs: rows of `runs.parquet`, one run per variant, budget, alpha0 and seed, whatever their protocols.
    long_episodes: `steps, mode, final_distance, share_within_radius` of the same runs at several episode lengths (C14).
    peers: `algorithm, seed, success_rate` (C19).
    untrained: success rate of a network before training, on the same resets (C16).
    """

    runs: pd.DataFrame
    long_episodes: pd.DataFrame | None = None
    peers: pd.DataFrame | None = None
    untrained: float | None = None


def with_twins(runs: pd.DataFrame, twins: Mapping[str, Mapping[str, str]]) -> pd.DataFrame:
    """The runs, and again under its other name each variant that its protocol trains as another one.

    `twins`: by protocol, variant -> the variant that has the same training there; one that was trained itself stays.
    """
    parts = [runs]
    for protocol, names in twins.items():
        own = runs[(runs["protocol"] == protocol) & runs["variant"].isin(names)]
        parts.append(own.assign(variant=own["variant"].map(names)))
    return pd.concat(parts, ignore_index=True).drop_duplicates([*CELL, "seed"], ignore_index=True)


def derive(runs: pd.DataFrame) -> pd.DataFrame:
    """Add the per-run quantities that claims average; a diverged run's stay missing.

    `early_peak`: peak within 25 to 50 iterations; `lost`: ends more than a quarter of |peak| below its peak;
    `timed`: steps to the threshold, a run that never gets there counted at its whole budget.
    """
    if "peak_return" not in runs:
        return runs
    known = runs["peak_return"].notna()
    early = runs["peak_iteration"].between(25, 50)
    lost = runs["drop_from_peak"] > 0.25 * runs["peak_return"].abs()
    return runs.assign(
        early_peak=early.astype(float).where(known),
        lost=lost.astype(float).where(known),
        timed=steps_or_budget(runs),
    )


def measure(study: Study, level: float = stats.LEVEL) -> Measured:
    """Estimates of all claims by claim and name; one that the study lacks the data for is not there."""
    own = Sample(derive(_bare(study.runs)), level, study.untrained) if len(study.runs) else None
    long = Sample(widen(study.long_episodes), level) if study.long_episodes is not None else None
    found: Measured = {
        claim: _estimates(formulas, long if claim == LONG_EPISODES else own) for claim, formulas in FORMULAS.items()
    }
    found[PEERS] = {}
    if study.peers is not None:
        for algorithm in OFF_POLICY:
            with suppress(MissingError):
                found[PEERS][algorithm] = off_policy_gain(study.peers, algorithm, level)
    return found


def _estimates(formulas: Mapping[str, Formula], sample: Sample | None) -> dict[str, Estimate]:
    found: dict[str, Estimate] = {}
    if sample is None:
        return found
    for name, formula in formulas.items():
        sample.start()
        with suppress(MissingError):
            found[name] = formula(sample)
    return found


def _bare(runs: pd.DataFrame) -> pd.DataFrame:
    return runs.drop(columns=["protocol", "diverged"], errors="ignore")


def widen(long_episodes: pd.DataFrame) -> pd.DataFrame:
    """Runs x episode lengths (`steps`), stochastic policy -> a row per run with `<metric>_<steps>`."""
    key, metrics = [*CELL, "seed"], ["final_distance", "share_within_radius"]
    kept = long_episodes[long_episodes["mode"] == "stochastic"] if "mode" in long_episodes else long_episodes
    wide = kept.pivot_table(index=key, columns="steps", values=[m for m in metrics if m in kept])
    wide.columns = wide.columns.map("{0[0]}_{0[1]}".format)
    return wide.reset_index()


def as_published(study: Study, published: pd.DataFrame) -> Study:
    """The study as it would be were the published tables the truth: their values with the noise of our seeds.

    Success rates keep their deviations from the cell's mean, returns their ratio to it; all else is left out, as the
    paper gives no number for it. `published`: `variant, budget, alpha0, success_rate, mean_return`.
    """
    runs = study.runs[[*CELL, "seed", "success_rate", "mean_return"]].merge(published, on=CELL, suffixes=("", "_true"))
    means = runs.groupby(CELL)[["success_rate", "mean_return"]].transform("mean")
    success = runs["success_rate"] - means["success_rate"] + runs["success_rate_true"]
    back = runs["mean_return"] / means["mean_return"] * runs["mean_return_true"]
    moved = runs[[*CELL, "seed"]].assign(success_rate=success, mean_return=back)
    return Study(moved, untrained=study.untrained)
