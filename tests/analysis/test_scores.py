"""Robust averages and performance profiles, by hand and by scipy."""

import numpy as np
import pytest
import synthetic
from scipy import stats as scipy_stats

from reacher_shaping.analysis import scores

GRID = [("paper", variant, 500_000, 1.0) for variant in ("none", "l2", "l2sq")]


def test_scores_are_mean_iqm_and_chance_to_beat_none():
    runs = synthetic.runs(GRID, 8)
    table = scores.scores_frame(runs).set_index(["variant", "metric"])
    ours, none = (runs.loc[runs["variant"] == variant, "success_rate"].to_numpy() for variant in ("l2", "none"))
    row = table.loc[("l2", "success_rate")]
    assert row["seeds"] == 8
    assert row["mean"] == pytest.approx(ours.mean())
    assert row["iqm"] == pytest.approx(np.sort(ours)[2:6].mean())
    assert row["iqm_low"] < row["iqm"] < row["iqm_high"]
    assert row["improvement"] == pytest.approx(scipy_stats.mannwhitneyu(ours, none).statistic / 64)
    assert table.loc[("none", "success_rate"), ["improvement", "improvement_low"]].isna().all()


def test_profile_is_the_share_of_runs_above_each_threshold():
    runs = synthetic.runs(GRID, 5)
    runs["success_rate"] = np.where(runs["variant"] == "l2", 0.5, 0.1)
    table = scores.profiles_frame(runs).set_index(["kind", "threshold"])["share"]
    assert table.loc["constant", 0.2] == 0.5  # l2 of l2 and l2sq
    assert table.loc["none", 0.2] == 0
    assert table.loc["constant", 0.08] == table.loc["none", 0.08] == 1
    assert table.groupby("kind").apply(lambda shares: shares.is_monotonic_decreasing).all()


def test_profile_limits_stay_within_nothing_and_all():
    frame = scores.profiles_frame(synthetic.runs(GRID, 5))
    assert (frame["share_low"] >= 0).all()
    assert (frame["share_high"] <= 1).all()
