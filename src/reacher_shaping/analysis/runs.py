"""From the blocks' tables to the study's: a row per run, per cell, per pair of correlated columns.

A block is `(key, progress, episodes)`: the cell's `protocol, variant, budget, alpha0` and design (`labels.DESIGN`), and
two frames in the columns of the data contract. Blocks are taken one at a time from any iterable, so a study of 230 runs
never holds more than one block's episodes.

Unprefixed evaluation columns are the stochastic evaluation, the paper's; `deterministic_` ones use the
mean action. `diverged` marks a run with a value that is not finite; its curve measures are missing (NaN),
and means over seeds leave missing values out while `cells.diverged` says how many there were.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from reacher_shaping import stats
from reacher_shaping.analysis import learning_curves
from reacher_shaping.evaluation.metrics import EVALUATION, evaluation_metrics
from reacher_shaping.labels import DESIGN, KEY

Block = tuple[Mapping[str, Any], pd.DataFrame, pd.DataFrame]
CURVE = ["peak_return", "peak_iteration", "final_return", "drop_from_peak", "roughness", "shaking", "area_under_curve"]
METRICS = EVALUATION + [f"deterministic_{name}" for name in EVALUATION] + CURVE + ["steps_to_threshold", "action_std"]
RUNS = [*KEY, "seed", "episodes", *METRICS, "diverged", *DESIGN]
RATES = [name for name in METRICS if name.endswith("success_rate")]
RADII = tuple(round(0.005 * step, 3) for step in range(1, 11))
OVER_SEEDS = "95 % t over seeds"
OVER_EPISODES = "95 % Wilson over episodes"
# Part of the way from the start to the peak of the unshaped agent that counts as "learned" (C17).
LEARNED = 0.8


def curve_array(progress: pd.DataFrame, column: str = "episode_return") -> pd.DataFrame:
    """A progress column as [S, T]: index seed, columns env_steps."""
    return progress.pivot(index="seed", columns="env_steps", values=column)


def _block_runs(block: Block) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The runs of one block without `steps_to_threshold`, and their learning curves [S, T]."""
    key, progress, episodes = block
    curve = curve_array(progress)
    runs = pd.DataFrame({"seed": curve.index}).set_index("seed")
    stochastic = evaluation_metrics(episodes, "stochastic").reindex(runs.index)
    deterministic = evaluation_metrics(episodes, "deterministic").reindex(runs.index)
    runs = runs.join(stochastic).join(deterministic.drop(columns="episodes").add_prefix("deterministic_"))
    runs["episodes"] = runs["episodes"].fillna(0).astype("int64")
    for name, values in learning_curves.measures(curve.to_numpy()).items():
        runs[name] = values
    action_std = curve_array(progress, "action_std")
    runs["action_std"] = action_std.iloc[:, -1]
    watched = [curve, action_std, runs[["mean_return"]]]
    runs["diverged"] = ~np.logical_and.reduce([np.isfinite(frame.to_numpy()).all(axis=1) for frame in watched])
    for name in reversed(KEY):
        runs.insert(0, name, key[name])
    runs = runs.assign(**{name: key[name] for name in DESIGN})
    return runs.reset_index(), curve


def learned_threshold(blocks: Iterable[tuple[pd.DataFrame, pd.DataFrame]]) -> float:
    """The return every run of one protocol is timed to (C17).

    `LEARNED` of the way from where the unshaped agent starts to its peak (smoothed curves, mean over its
    runs): a fixed number would be trivial in one protocol and out of reach in another. Taken from the
    baseline alone, so that no shaped variant moves its own goal; from all runs where there is no baseline.
    """
    blocks = list(blocks)
    chosen = [block for block in blocks if block[0]["variant"].iloc[0] == "none"] or blocks
    start = stats.mean(np.concatenate([learning_curves.smooth(curve.to_numpy())[:, 0] for _, curve in chosen]))
    peak = stats.mean(np.concatenate([runs["peak_return"].to_numpy() for runs, _ in chosen]))
    return start + LEARNED * (peak - start)


def runs_frame(blocks: Iterable[Block]) -> pd.DataFrame:
    """`runs.parquet`: a row per run, columns `RUNS`. Raises ValueError for no block or a run given twice."""
    parts = [_block_runs(block) for block in blocks]
    if not parts:
        raise ValueError("no seed block to aggregate")
    for protocol in {runs["protocol"].iloc[0] for runs, _ in parts}:
        own = [part for part in parts if part[0]["protocol"].iloc[0] == protocol]
        threshold = learned_threshold(own)
        for runs, curve in own:
            values, steps = curve.to_numpy(), curve.columns.to_numpy()
            runs["steps_to_threshold"] = learning_curves.steps_to_threshold(values, steps, threshold)
    runs = pd.concat([part[0] for part in parts], ignore_index=True)
    if runs.duplicated([*KEY, "seed"]).any():
        twice = runs.loc[runs.duplicated([*KEY, "seed"]), [*KEY, "seed"]].iloc[0].to_list()
        raise ValueError(f"run given twice: {twice}")
    runs = runs.astype({"budget": "int64", "seed": "int64", "alpha0": float, "diverged": bool, "horizon": float})
    return runs.sort_values([*KEY, "seed"], ignore_index=True)[RUNS]


def steps_or_budget(runs: pd.DataFrame) -> "pd.Series[float]":
    """Steps to the threshold, a run that never gets there counted at its whole budget; missing if it diverged.

    A mean over those that got there alone would make a rule look the faster the more of its runs fail.
    """
    counted = runs["steps_to_threshold"].fillna(runs["budget"]).astype(float)
    return counted.where(runs["peak_return"].notna())


def summarise(sample: ArrayLike, name: str) -> dict[str, float]:
    """Mean over seeds [S], IQM and the t interval of the mean, under the suffixes of `cells.parquet`.

    Limits of a rate or share, known by its name, end at 0 and 1.
    """
    low, high = stats.t_interval(sample)
    if "rate" in name or "share" in name:
        low, high = np.clip([low, high], 0.0, 1.0)
    return {"": stats.mean(sample), "_iqm": stats.iqm(sample), "_low": low, "_high": high}


def _cell(runs: pd.DataFrame) -> dict[str, Any]:
    """One row of `cells.parquet` from the runs of one cell."""
    single = len(runs) == 1
    row = {name: runs[name].iloc[0] for name in KEY} | {"seeds": len(runs), "diverged": int(runs["diverged"].sum())}
    row["interval"] = OVER_EPISODES if single else OVER_SEEDS
    for name in METRICS:
        if name not in runs:  # runs kept from before it was measured
            continue
        summary = summarise(steps_or_budget(runs) if name == "steps_to_threshold" else runs[name], name)
        if single and name in RATES and np.isfinite(summary[""]):
            episodes = int(runs["episodes"].iloc[0])
            summary["_low"], summary["_high"] = stats.wilson_interval(round(summary[""] * episodes), episodes)
        row |= {name + suffix: value for suffix, value in summary.items()}
    return row | {name: runs[name].iloc[0] for name in DESIGN}


def cells_frame(runs: pd.DataFrame) -> pd.DataFrame:
    """`cells.parquet`: a row per cell. For each metric M of `METRICS`: M (mean over seeds), M_iqm, M_low, M_high.

    `interval` says what the limits are. With one seed the success rates carry a Wilson interval over
    episodes, which knows nothing of other seeds, and all other metrics have none (NaN). All limits are for the
    1000 resets that every run is evaluated on; other resets would move a level by up to its binomial error
    (`variance.parquet`) and hardly a difference between cells.
    """
    return pd.DataFrame([_cell(cell) for _, cell in runs.groupby(KEY, sort=True)])


def radius_frame(
    blocks: Iterable[tuple[Mapping[str, Any], pd.DataFrame]], radii: Sequence[float] = RADII
) -> pd.DataFrame:
    """Success against radius: a row per cell, seed, mode and radius (metres, inclusive), from (key, episodes) pairs.

    `success_rate`: within the radius at any step; `final_success_rate`: at the last one.
    """
    parts = []
    for key, episodes in blocks:
        groups = [episodes["seed"], episodes["mode"]]
        for radius in radii:
            hits = (episodes[["min_distance", "final_distance"]] <= radius).groupby(groups).mean().reset_index()
            hits.columns = pd.Index(["seed", "mode", "success_rate", "final_success_rate"])
            parts.append(hits.assign(radius=radius, **{name: key[name] for name in KEY}))
    frame = pd.concat(parts, ignore_index=True)
    order = [*KEY, "seed", "mode", "radius"]
    return frame.sort_values(order, ignore_index=True)[[*order, "success_rate", "final_success_rate"]]


def over_seeds(frame: pd.DataFrame, by: Sequence[str], metrics: Sequence[str]) -> pd.DataFrame:
    """A row per group of `by` with the number of `seeds`, and mean, IQM and interval over them of each metric."""
    rows = []
    for key, group in frame.groupby(list(by)):
        row = dict(zip(by, key, strict=True)) | {"seeds": len(group)}
        for name in metrics:
            row |= {name + suffix: value for suffix, value in summarise(group[name], name).items()}
        rows.append(row)
    return pd.DataFrame(rows)


def radius_cells(radius: pd.DataFrame) -> pd.DataFrame:
    """`radius_frame` over seeds: a row per cell, mode and radius."""
    return over_seeds(radius, [*KEY, "mode", "radius"], ["success_rate", "final_success_rate"])


def length_cells(long_episodes: pd.DataFrame) -> pd.DataFrame:
    """Evaluations at several episode lengths, over seeds: a row per cell, mode and length (`steps`)."""
    metrics = ["success_rate", "final_success_rate", "final_distance", "return_per_step", "share_within_radius"]
    return over_seeds(long_episodes, [*KEY, "mode", "steps"], metrics)
