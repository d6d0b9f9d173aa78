from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import synthetic
from scipy import stats as scipy_stats

from reacher_shaping.analysis.correlation import CORRELATED, by_protocol, correlations
from reacher_shaping.analysis.runs import (
    METRICS,
    OVER_EPISODES,
    OVER_SEEDS,
    RUNS,
    cells_frame,
    radius_cells,
    radius_frame,
    runs_frame,
)

PUBLISHED = Path(__file__).parents[2] / "report" / "published"
KEY = {"protocol": "paper", "variant": "l2", "budget": 500_000, "alpha0": 1.0}


def make_block(variant="l2", seeds=(0, 1, 2), iterations=30, episodes=20, level=0.0, **key):
    """Made-up block whose seeds differ; `level` shifts every learning curve."""
    random = np.random.default_rng([len(variant), *seeds])
    progress, evaluation = [], []
    for seed in seeds:
        curve = -50 + level + 40 * (1 - np.exp(-np.arange(iterations) / 5)) + random.normal(0, 0.5, iterations) + seed
        steps = 2048 * np.arange(1, iterations + 1)
        columns = {"iteration": np.arange(1, iterations + 1), "env_steps": steps, "episode_return": curve}
        progress.append(pd.DataFrame(columns).assign(seed=seed, action_std=np.linspace(1, 0.1, iterations)))
        for mode in ("stochastic", "deterministic"):
            minimum = random.uniform(0, 0.1, episodes)
            frame = pd.DataFrame({"seed": seed, "mode": mode, "episode": range(episodes), "min_distance": minimum})
            frame["final_distance"] = minimum + random.uniform(0, 0.05, episodes)
            frame["success"], frame["final_success"] = minimum <= 0.02, frame["final_distance"] <= 0.02
            frame["reward_distance"], frame["reward_control"] = -50 * minimum, -0.1 - 0.01 * seed
            frame["episode_return"] = frame["reward_distance"] + frame["reward_control"]
            frame["first_hit_step"] = pd.array(np.where(frame["success"], 7, -1), dtype="Int64")
            frame.loc[~frame["success"], "first_hit_step"] = pd.NA
            frame["share_within_radius"] = frame["success"] / 5
            evaluation.append(frame)
    return KEY | {"variant": variant} | synthetic.design(variant) | key, pd.concat(progress), pd.concat(evaluation)


def test_run_row_holds_the_means_of_its_own_episodes():
    key, progress, episodes = make_block()
    runs = runs_frame([(key, progress, episodes)])
    own = episodes[(episodes["seed"] == 1) & (episodes["mode"] == "stochastic")]
    row = runs[runs["seed"] == 1].iloc[0]
    assert list(runs.columns) == RUNS
    assert row["episodes"] == 20
    assert row["success_rate"] == own["success"].sum() / 20
    assert row["mean_return"] == pytest.approx(np.average(own["episode_return"]))
    assert row["first_hit_step"] == 7
    assert row["share_within_radius"] == pytest.approx(row["success_rate"] / 5)
    mean_action = episodes[(episodes["seed"] == 1) & (episodes["mode"] == "deterministic")]
    assert row["deterministic_final_distance"] == pytest.approx(np.average(mean_action["final_distance"]))
    assert row["reward_distance"] + row["reward_control"] == pytest.approx(row["mean_return"])
    assert row["action_std"] == pytest.approx(0.1)
    assert not row["diverged"]


def test_rows_of_the_inputs_may_come_in_any_order():
    key, progress, episodes = make_block()
    shuffled = (key, progress.sample(frac=1, random_state=1), episodes.sample(frac=1, random_state=2))
    straight = runs_frame([(key, progress, episodes)])
    pd.testing.assert_frame_equal(runs_frame([shuffled]), straight)


def test_blocks_of_one_cell_join_and_do_not_influence_each_other():
    both = runs_frame([make_block(seeds=(0, 1)), make_block(seeds=(2, 3))])
    alone = runs_frame([make_block(seeds=(2, 3))])
    assert both["seed"].tolist() == [0, 1, 2, 3]
    free = [name for name in RUNS if name != "steps_to_threshold"]  # set by the whole study's baseline
    pd.testing.assert_frame_equal(both[free].iloc[2:].reset_index(drop=True), alone[free])


def test_a_run_given_twice_is_refused():
    with pytest.raises(ValueError, match="twice"):
        runs_frame([make_block(), make_block(seeds=(2, 3))])


def test_no_block_is_refused():
    with pytest.raises(ValueError, match="no seed block"):
        runs_frame([])


def test_threshold_comes_from_the_baseline_alone():
    baseline, slow = make_block("none"), make_block("l2", level=-30.0)
    alone = runs_frame([baseline])["steps_to_threshold"]
    runs = runs_frame([baseline, slow]).set_index("variant")["steps_to_threshold"]
    np.testing.assert_array_equal(runs["none"], alone)
    assert alone.notna().all()
    assert runs["l2"].isna().all()


def test_diverged_run_is_marked_and_left_out_of_the_means():
    key, progress, episodes = make_block()
    progress.loc[(progress["seed"] == 2) & (progress["iteration"] > 10), "episode_return"] = np.nan
    runs = runs_frame([(key, progress, episodes)])
    assert runs["diverged"].tolist() == [False, False, True]
    cell = cells_frame(runs).iloc[0]
    assert cell["diverged"] == 1
    assert cell["seeds"] == 3
    assert cell["final_return"] == pytest.approx(runs["final_return"].iloc[:2].mean())


def test_missing_deterministic_evaluation_is_missing_not_zero():
    key, progress, episodes = make_block()
    runs = runs_frame([(key, progress, episodes[episodes["mode"] == "stochastic"])])
    assert runs["deterministic_success_rate"].isna().all()
    assert not runs["diverged"].any()


def test_cell_holds_mean_iqm_and_interval_of_its_seeds():
    runs = runs_frame([make_block(seeds=range(8)), make_block("none", seeds=range(8))])
    cells = cells_frame(runs)
    row, own = cells[cells["variant"] == "l2"].iloc[0], runs[runs["variant"] == "l2"]
    assert row["seeds"] == 8
    assert row["interval"] == OVER_SEEDS
    for name in METRICS:
        if name == "steps_to_threshold":
            continue
        assert row[name] == pytest.approx(own[name].mean(), nan_ok=True)
        assert row[f"{name}_low"] <= row[name] + 1e-12
        assert row[name] <= row[f"{name}_high"] + 1e-12
    ordered = np.sort(own["success_rate"])
    assert row["success_rate_iqm"] == pytest.approx(ordered[2:6].mean())


def test_interval_of_a_cell_does_not_depend_on_the_other_cells():
    l2, none = make_block(seeds=range(4)), make_block("none", seeds=range(4))
    together = cells_frame(runs_frame([l2, none]))
    runs = runs_frame([l2])
    alone = cells_frame(runs).iloc[0]
    assert together[together["variant"] == "l2"].iloc[0]["mean_return_low"] == alone["mean_return_low"]


def test_a_run_that_never_gets_there_counts_at_its_whole_budget():
    """Else a rule would seem the faster the more of its runs fail."""
    runs = runs_frame([make_block("none", seeds=range(4)), make_block(seeds=range(4), level=-30.0)])
    slow = cells_frame(runs).set_index("variant").loc["l2"]
    assert runs.set_index("variant").loc["l2", "steps_to_threshold"].isna().all()
    assert slow["steps_to_threshold"] == KEY["budget"]


def test_limits_of_a_rate_end_at_one():
    runs = runs_frame([make_block(seeds=range(3))]).assign(success_rate=[0.9, 1.0, 1.0])
    assert cells_frame(runs)["success_rate_high"].iloc[0] == 1


def test_runs_kept_from_before_a_measure_have_no_column_of_it():
    runs = runs_frame([make_block()]).drop(columns="shaking")
    assert "shaking" not in cells_frame(runs)


def test_one_seed_gets_a_wilson_interval_over_episodes_and_says_so():
    runs = runs_frame([make_block(seeds=(4,), episodes=50)])
    cell = cells_frame(runs).iloc[0]
    p, n, z = cell["success_rate"], 50, scipy_stats.norm.ppf(0.975)
    centre, half = p + z**2 / (2 * n), z * np.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
    assert cell["interval"] == OVER_EPISODES
    assert cell["success_rate_low"] == pytest.approx((centre - half) / (1 + z**2 / n))
    assert cell["success_rate_high"] == pytest.approx((centre + half) / (1 + z**2 / n))
    assert np.isnan(cell["mean_return_low"])
    assert np.isnan(cell["mean_return_high"])


def published_table_2():
    table = pd.read_csv(PUBLISHED / "table2.csv")
    budget = table["num_episodes"].map({"500K": 500_000, "1M": 1_000_000})
    return table.rename(columns={"variant_base": "variant", "alpha": "alpha0"}).assign(
        protocol="paper", budget=budget, seed=0
    )


def test_published_table_gives_the_published_correlations():
    """The paper prints 0.91, 0.37, 0.30 (its Fig. 3); from its Table 2 they are 0.910, 0.369, 0.305."""
    matrix = correlations(published_table_2(), "cells")
    r = matrix[matrix["method"] == "pearson"].set_index(["x", "y"])["r"]
    assert r["alpha0", "mean_return"] == pytest.approx(0.910, abs=5e-4)
    assert r["success_rate", "mean_return"] == pytest.approx(0.369, abs=5e-4)
    assert r["success_rate", "budget"] == pytest.approx(0.305, abs=5e-4)
    assert (matrix["n"] == 17).all()
    assert matrix[["ci_low", "ci_high"]].isna().all(axis=None)  # one seed: other cells are no other seeds


def test_correlations_agree_with_pandas_and_are_symmetric():
    rows = published_table_2()
    matrix = correlations(rows, "cells")
    for method in ("pearson", "spearman"):
        own = matrix[matrix["method"] == method].pivot(index="x", columns="y", values="r")
        oracle = rows[CORRELATED].corr(method)
        np.testing.assert_allclose(own.loc[oracle.index, oracle.columns], oracle, atol=1e-12)


@pytest.mark.parametrize("level", ["cells", "runs"])
def test_interval_of_a_correlation_leaves_out_a_seed_in_every_cell_at_once(level):
    blocks = [make_block(name, seeds=range(6), budget=b) for name in ("none", "l2", "decay200k") for b in (1, 2)]
    runs = runs_frame(blocks)
    matrix = correlations(runs, level).set_index(["method", "x", "y"])

    def r(rows):
        measures = ["success_rate", "mean_return"]
        points = rows[measures] if level == "runs" else rows.groupby(["variant", "budget"])[measures].mean()
        return np.arctanh(points.corr().iloc[0, 1])

    z, left_out = r(runs), np.array([r(runs[runs["seed"] != seed]) for seed in range(6)])
    half = scipy_stats.t.ppf(0.975, 5) * np.sqrt(5 / 6 * ((left_out - left_out.mean()) ** 2).sum())
    row = matrix.loc["pearson", "success_rate", "mean_return"]
    assert np.arctanh([row["ci_low"], row["r"], row["ci_high"]]) == pytest.approx([z - half, z, z + half])
    assert np.isnan(matrix.loc[("pearson", "alpha0", "budget"), "ci_low"])


def test_correlation_frame_keeps_appendix_and_protocols_apart():
    blocks = [make_block(name, budget=b) for name in ("none", "l2", "decay200k_l2sq") for b in (500_000, 1_000_000)]
    blocks += [make_block(name, protocol="standard") for name in ("none", "l2")]
    frame = by_protocol(runs_frame(blocks))
    n = frame.groupby(["protocol", "level"])["n"].first()
    assert n["paper"].to_dict() == {"cells": 4, "cells_all": 6, "runs": 12, "runs_all": 18}
    assert n["standard", "cells"] == 2
    assert list(frame.columns) == ["method", "x", "y", "r", "ci_low", "ci_high", "n", "level", "protocol"]


def test_radius_frame_counts_from_the_distances():
    key, _, episodes = make_block(seeds=(0,))
    frame = radius_frame([(key, episodes)]).set_index(["mode", "radius"])
    own = episodes[episodes["mode"] == "stochastic"]
    assert frame.loc[("stochastic", 0.02), "success_rate"] == own["success"].mean()
    assert frame.loc[("stochastic", 0.05), "final_success_rate"] == np.mean(own["final_distance"] <= 0.05)
    assert frame.loc["deterministic", "success_rate"].is_monotonic_increasing
    assert len(frame) == 20


def test_radius_cells_average_over_seeds():
    key, _, episodes = make_block(seeds=range(4))
    radius = radius_frame([(key, episodes)])
    cells = radius_cells(radius)
    at = (radius["mode"] == "stochastic") & (radius["radius"] == 0.03)
    row = cells[(cells["mode"] == "stochastic") & (cells["radius"] == 0.03)].iloc[0]
    assert row["seeds"] == 4
    assert row["success_rate"] == pytest.approx(radius[at]["success_rate"].mean())
