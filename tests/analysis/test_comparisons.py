from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import synthetic
from scipy import stats as scipy_stats

from reacher_shaping import stats
from reacher_shaping.analysis import comparisons, learning_curves, single_seed_studies
from reacher_shaping.analysis.claim_formulas import BEST, TABLE_2, TABLE_3
from reacher_shaping.analysis.runs import RUNS
from reacher_shaping.report import paper_tables

PUBLISHED = Path(__file__).parents[2] / "report" / "published"


def make_runs(cells=TABLE_2 + TABLE_3, seeds=6, noise=0.05, gain=None, protocol="paper"):
    random = np.random.default_rng(4)
    parts = []
    for variant, budget, alpha0 in cells:
        key = {"protocol": protocol, "variant": variant, "budget": budget, "alpha0": alpha0}
        rate = 0.3 + (gain or {}).get((variant, budget, alpha0), 0.0) + random.normal(0, noise, seeds)
        frame = pd.DataFrame(key | {"seed": range(seeds), "episodes": 1000, "success_rate": rate})
        frame["mean_return"] = random.normal(-12, 1, seeds)
        frame["final_success_rate"], frame["final_distance"] = rate / 2, 0.1 - rate / 10
        parts.append(frame.assign(**synthetic.design(variant)))
    return pd.concat(parts, ignore_index=True)


def published():
    table3 = pd.read_csv(PUBLISHED / "table3.csv").assign(alpha=0.5)
    return paper_tables.published_cells(pd.read_csv(PUBLISHED / "table2.csv"), table3)


def at(frame, **values):
    return frame[np.logical_and.reduce([frame[name] == value for name, value in values.items()])]


def test_families_compare_the_cells_they_name():
    frame = at(comparisons.comparison_frame(make_runs()), metric="success_rate")
    assert frame.groupby("family").size().to_dict() == {
        "none": 21, "constant": 12, "longer": 9, "half": 5, "squared": 6,
    }  # fmt: skip
    against_none = at(frame, family="none")
    assert (against_none["other_variant"] == "none").all()
    assert (against_none["other_budget"] == against_none["budget"]).all()
    decayed = at(frame, family="constant", variant="decay200k_l2sq").iloc[0]
    assert (decayed["other_variant"], decayed["other_alpha0"]) == ("l2sq", 0.5)
    squared = at(frame, family="squared")
    assert set(squared["variant"]) == {"l2sq", "decay200k_l2sq", "decay300k_l2sq", "decay500k_l2sq"}
    assert (squared["other_variant"] == squared["variant"].str.removesuffix("_l2sq").replace("l2sq", "l2")).all()
    assert (squared["alpha0"] == squared["other_alpha0"]).all()
    longer = at(frame, family="longer", variant="none").iloc[0]
    assert (longer["budget"], longer["other_budget"]) == (1_000_000, 500_000)


def test_a_comparison_is_the_paired_difference_of_its_two_cells():
    runs = make_runs(gain={("l2", 500_000, 1.0): 0.3})
    row = at(comparisons.comparison_frame(runs), family="none", metric="success_rate", variant="l2", budget=500_000)
    row = at(row, alpha0=1.0).iloc[0]
    ours, theirs = (at(runs, variant=v, budget=500_000, alpha0=1.0)["success_rate"].to_numpy() for v in ("l2", "none"))
    assert row["difference"] == pytest.approx((ours - theirs).mean())
    assert row["p"] == pytest.approx(scipy_stats.ttest_rel(ours, theirs).pvalue)
    assert row["improvement"] == pytest.approx(scipy_stats.mannwhitneyu(ours, theirs).statistic / 36)
    assert row["ci_low"] < row["difference"] < row["ci_high"]


def test_holm_is_over_one_family_of_one_metric():
    frame = comparisons.comparison_frame(make_runs())
    own = at(frame, family="half", metric="mean_return")
    np.testing.assert_allclose(own["p_holm"], stats.holm(own["p"]))
    assert (frame["p_holm"] >= frame["p"]).all()


def test_limits_of_a_family_hold_for_all_its_comparisons_at_once():
    """Bonferroni's: of 21 comparisons each is read at 1 - 0.05 / 21."""
    runs = make_runs()
    row = at(comparisons.comparison_frame(runs), family="none", metric="mean_return", variant="l2", alpha0=0.5).iloc[0]
    ours, theirs = (
        at(runs, variant=v, budget=500_000, alpha0=a)["mean_return"].to_numpy() for v, a in (("l2", 0.5), ("none", 1.0))
    )
    oracle = scipy_stats.ttest_rel(ours, theirs).confidence_interval(1 - 0.05 / 21)
    assert (row["family_low"], row["family_high"]) == pytest.approx(tuple(oracle))


def test_smaller_distance_is_an_improvement():
    frame = at(comparisons.comparison_frame(make_runs(gain={BEST: 0.5})), family="none", variant="decay300k")
    best = at(frame, budget=1_000_000).set_index("metric")
    assert best.loc["final_distance", "difference"] < 0
    assert best.loc["final_distance", "improvement"] == best.loc["success_rate", "improvement"] == 1


def test_only_common_seeds_are_compared():
    runs = make_runs(cells=[("none", 500_000, 1.0), ("l2", 500_000, 1.0)])
    runs = runs[~((runs["variant"] == "none") & (runs["seed"] < 2))]
    assert (comparisons.comparison_frame(runs)["seeds"] == 4).all()


def test_a_study_without_pairs_has_an_empty_table():
    frame = comparisons.comparison_frame(make_runs(cells=[("l2", 500_000, 1.0)]))
    assert frame.empty
    assert {"family", "difference", "p_holm", "seeds"} <= set(frame.columns)


def test_variance_of_a_cell_is_split():
    frame = comparisons.variance_frame(make_runs(cells=[("l2", 500_000, 1.0)], seeds=400, noise=0.08))
    assert frame["seed_variance"].iloc[0] == pytest.approx(0.08**2, rel=0.15)
    assert frame["evaluation_variance"].iloc[0] == pytest.approx(0.3 * 0.7 / 1000, rel=0.1)
    assert frame["resets_deviation"].iloc[0] == pytest.approx(np.sqrt(0.3 * 0.7 / 1000), rel=0.05)


def test_power_is_for_the_published_gain():
    runs = make_runs()
    frame = comparisons.power_frame(runs, published())
    row = at(frame, variant="l2", budget=1_000_000).iloc[0]
    assert row["published_gain"] == pytest.approx(0.253 - 0.107)
    ours, none = (at(runs, variant=v, budget=1_000_000)["success_rate"].to_numpy() for v in ("l2", "none"))
    assert row["deviation"] == pytest.approx((ours - none).std(ddof=1))
    assert row["power"] == pytest.approx(stats.power(0.253 - 0.107, row["deviation"], 6))
    assert row["power_3"] < row["power"]
    assert len(frame) == 21


def test_roughness_stability_is_one_without_smoothing():
    random = np.random.default_rng(0)
    blocks = []
    for protocol in ("paper", "standard"):
        steps = np.arange(1, 201)
        curves = -20 + random.normal(size=(8, 200)) * np.linspace(0.2, 3, 8)[:, None]
        progress = pd.DataFrame({"seed": np.repeat(range(8), 200), "env_steps": np.tile(steps, 8)})
        progress["episode_return"] = curves.ravel()
        blocks.append(({"protocol": protocol}, progress, pd.DataFrame()))
    frame = comparisons.roughness_stability(blocks)
    assert frame["window"].tolist() == [*learning_curves.WINDOWS] * 2
    assert at(frame, window=1)["spearman"].tolist() == pytest.approx([1, 1])
    assert (frame["spearman"] > 0.8).all()
    assert (frame["runs"] == 8).all()


# The single-seed lottery


def test_without_seed_noise_every_study_says_the_same():
    runs = make_runs(noise=0.0, gain={BEST: 0.5})
    studies = single_seed_studies.single_seed_studies(runs, np.random.default_rng(0), 50)
    assert single_seed_studies.winners_frame(studies).to_dict("records") == [
        {"variant": "decay300k", "budget": 1_000_000, "alpha0": 1.0, "share": 1.0}
    ]
    shares = single_seed_studies.lottery_frame(studies).set_index("statement")["share"]
    assert shares["decay300k at 1M is the best cell"] == 1
    assert shares["the best cell more than doubles `none` at 1M"] == 1
    assert shares["no shaping is the best"] == 0
    assert shares["13 or more of 15 shaped cells are above `none`"] == 0


def test_equal_cells_win_equally_often():
    runs = make_runs(seeds=200)
    winners = single_seed_studies.winners_frame(
        single_seed_studies.single_seed_studies(runs, np.random.default_rng(0), 20_000)
    )
    assert winners["share"].sum() == pytest.approx(1)
    assert len(winners) == 17
    assert winners["share"].between(0.025, 0.11).all()


def test_published_table_as_a_study_makes_the_papers_statements():
    runs = published().assign(protocol="paper", seed=0)
    study = single_seed_studies.single_seed_studies(runs, np.random.default_rng(0), 1)
    said = study[list(single_seed_studies.STATEMENTS)].iloc[0]
    assert said.drop("no shaping is the best").all()
    assert not said["no shaping is the best"]
    assert study[single_seed_studies.CORRELATIONS].iloc[0].round(3).tolist() == [0.910, 0.369, 0.305]
    assert study["ratio"].iloc[0] == pytest.approx(0.258 / 0.107)


def test_spread_holds_ordered_quantiles():
    studies = single_seed_studies.single_seed_studies(make_runs(), np.random.default_rng(0), 500)
    spread = single_seed_studies.spread_frame(studies).set_index("quantity")
    assert (spread.diff(axis=1).iloc[:, 1:] >= 0).all(axis=None)
    assert spread.loc["ratio", "q50"] == pytest.approx(studies["ratio"].median())


def test_a_study_without_the_papers_cells_has_no_lottery():
    studies = single_seed_studies.single_seed_studies(make_runs(cells=TABLE_2[:3]), np.random.default_rng(0), 10)
    assert studies.empty
    assert single_seed_studies.lottery_frame(studies)["share"].isna().all()
    assert single_seed_studies.winners_frame(studies).empty
    assert single_seed_studies.spread_frame(studies)["q50"].isna().all()


def test_the_frames_use_columns_of_runs():
    assert set(comparisons.METRICS) <= set(RUNS)


def test_baseline_with_the_same_label_is_the_partner_where_there_is_one():
    cells = pd.DataFrame(
        [("p", "none", 100, 1.0), ("p", "none", 100, 0.5), ("q", "none", 100, 1.0)], columns=comparisons.KEY
    ).assign(**synthetic.design("none"))
    shaped = {"protocol": "p", "variant": "l2", "budget": 100, "alpha0": 0.5, **synthetic.design("l2")}
    assert comparisons.partner("none", shaped, cells)["alpha0"] == 0.5
    assert comparisons.partner("none", shaped | {"protocol": "q"}, cells)["alpha0"] == 1.0


def test_what_is_said_of_all_cells_by_hand():
    power = pd.DataFrame({"seeds_needed": [12.0, np.nan, 3.0]})
    assert comparisons.median_seeds_needed(power) == 12  # a cell without a number takes more than any
    assert comparisons.median_seeds_needed(power.iloc[:2]) == np.inf
    variance = pd.DataFrame({"seed_variance": [3.0, 0.0, 1.0], "evaluation_variance": [1.0, 0.0, 3.0]})
    shares = comparisons.seed_shares(variance)
    assert shares[[0, 2]].to_list() == [0.75, 0.25]
    assert np.isnan(shares[1])
    assert comparisons.extent(shares) == (0.25, 0.5, 0.75)
    assert comparisons.mean_difference(pd.DataFrame({"difference": [0.1, 0.3]})) == pytest.approx(0.2)
