"""What a switch does, what is logged, and whether two implementations agree, on made-up runs with known answers."""

import numpy as np
import pandas as pd
import pytest
import synthetic
from scipy import stats as scipy_stats
from switched import MEANS, NOISE, PROTOCOLS, SWITCHES, labelled_runs, peers, runs

from reacher_shaping.analysis import correlation, switch_effects
from reacher_shaping.analysis.baselines import AGREEMENT_METRICS, agreement_frame
from reacher_shaping.settings.cell import Environment


def effect(frame, switch, kind, metric="success_rate"):
    return frame[(frame["switch"] == switch) & (frame["effect"] == kind) & (frame["metric"] == metric)].iloc[0]


def test_effects_are_the_differences_of_the_cells_and_the_common_noise_cancels():
    frame = switch_effects.effects_frame(runs(MEANS), SWITCHES, PROTOCOLS)
    for switch, kind, expected in [
        ("all", "all", 0.30), ("a", "alone", 0.05), ("a", "last", 0.20), ("a", "interaction", 0.15),
        ("b", "alone", -0.02), ("b", "last", 0.10), ("b", "interaction", 0.12),
    ]:  # fmt: skip
        row = effect(frame, switch, kind)
        assert row["difference"] == pytest.approx(expected), (switch, kind)
        assert (row["ci_low"], row["ci_high"]) == pytest.approx((expected, expected))
        assert row["p"] < 1e-12
        assert row["seeds"] == len(NOISE)
    assert effect(frame, "a", "alone")["setting"] == "epochs 10 to 5"
    assert effect(frame, "all", "all")["setting"] == "every switch"


def test_holm_corrects_over_the_effects_of_one_kind_and_measure():
    table = runs(MEANS)
    table.loc[table["protocol"] == "paper_with_b", "success_rate"] = 0.28 + np.tile(NOISE[::-1], 1)
    frame = switch_effects.effects_frame(table, SWITCHES, PROTOCOLS)
    alone = frame[(frame["effect"] == "alone") & (frame["metric"] == "success_rate")]
    low, high = alone["p"].min(), alone["p"].max()
    assert low < high
    assert sorted(alone["p_holm"]) == pytest.approx([2 * low, max(2 * low, high)])


def test_returns_are_compared_at_one_control_weight():
    table = runs(MEANS)
    found = switch_effects.unit_return(table, PROTOCOLS)
    paper, late = (found[table["protocol"] == name].to_numpy() for name in ("paper", "late"))
    np.testing.assert_allclose(paper, -10 - 10 * (2 + np.arange(6)))  # trained at a weight of 0.1
    np.testing.assert_allclose(late, -10 - (2 + np.arange(6)))


def test_a_protocol_that_charges_nothing_has_no_return_at_another_weight():
    table = runs({"paper": 0.3}).assign(reward_control=0.0)
    free = PROTOCOLS["paper"].model_copy(update={"environment": Environment(control_weight=0.0)})
    assert switch_effects.unit_return(table, {"paper": free}).isna().all()
    free_and_scaled = switch_effects.unit_return(table.assign(reward_control=-1.0), {"paper": free})
    assert free_and_scaled.isna().all(), "not minus infinity"


def test_the_baseline_has_its_own_weight_in_an_experiment_of_another():
    switches = SWITCHES.model_copy(update={"variants": ("none", "l2"), "alpha0": 3.0})
    shaped = runs(MEANS, variant="l2").assign(alpha0=3.0)
    frame = switch_effects.effects_frame(pd.concat([runs(MEANS), shaped]), switches, PROTOCOLS)
    assert set(frame["variant"]) == {"none", "l2"}


def test_effect_without_its_cells_is_left_out():
    rest = {name: mean for name, mean in MEANS.items() if name != "paper_with_a"}
    frame = switch_effects.effects_frame(runs(rest), SWITCHES, PROTOCOLS)
    assert set(frame.loc[frame["switch"] == "a", "effect"]) == {"last"}
    assert set(frame.loc[frame["switch"] == "b", "effect"]) == {"alone", "last", "interaction"}
    assert switch_effects.effects_frame(runs(MEANS, budget=8192), SWITCHES, PROTOCOLS).empty


def test_a_cell_of_another_weight_is_no_part_of_an_effect():
    table = runs(MEANS)
    other = table[table["protocol"] == "late"].assign(alpha0=3.0, success_rate=0.99)
    frame = switch_effects.effects_frame(pd.concat([table, other]), SWITCHES, PROTOCOLS)
    assert effect(frame, "all", "all")["difference"] == pytest.approx(0.30)


def test_diverged_run_leaves_its_effects_only():
    table = runs(MEANS)
    table.loc[(table["protocol"] == "late_without_a") & (table["seed"] == 2), "success_rate"] = np.nan
    frame = switch_effects.effects_frame(table, SWITCHES, PROTOCOLS)
    assert effect(frame, "a", "last")["seeds"] == len(NOISE) - 1
    assert effect(frame, "b", "last")["seeds"] == len(NOISE)


def test_logs_tell_peak_and_end_of_the_logged_return():
    iteration = np.arange(1, 101)
    peaked = np.where(iteration <= 30, -100 + 2.0 * iteration, -40.0 - (iteration - 30))
    key = {"protocol": "released", "variant": "none", "budget": 204_800, "alpha0": 1.0}
    progress = pd.DataFrame(
        {
            "seed": 3,
            "iteration": iteration,
            "logged_return": peaked,
            "episode_return": 0.0,
            "action_std": 0.5 - 0.01 * (iteration - iteration.max()),
            **key,
        }
    ).sample(frac=1, random_state=1)
    row = switch_effects.logs_frame(progress).iloc[0]
    means = np.convolve(peaked, np.ones(20) / 20, mode="valid")
    assert row["peak_return"] == pytest.approx(means.max())
    assert row["peak_iteration"] == means.argmax() + 20
    assert row["final_return"] == pytest.approx(peaked[-20:].mean())
    assert (row["seed"], row["action_std"]) == (3, 0.5)


def test_labels_correlate_over_the_cells_of_the_main_table():
    table = labelled_runs()
    frame = correlation.over_protocols(table, synthetic.published(), "released")

    def r(level, x="alpha0", y="mean_return"):
        chosen = (frame["method"] == "pearson") & (frame["level"] == level) & (frame["x"] == x) & (frame["y"] == y)
        return frame.loc[chosen, ["r", "n"]].iloc[0]

    kept = table[~((table["variant"] == "none") & (table["alpha0"] == 0.5)) & (table["variant"] != "decay200k_l2sq")]
    means = kept.groupby(["protocol", "variant", "budget", "alpha0"], as_index=False)["mean_return"].mean()
    expected = np.corrcoef(means["alpha0"], means["mean_return"])[0, 1]
    assert (r("cells")["r"], r("cells")["n"]) == (pytest.approx(expected), 6)
    assert r("cells_all")["n"] == 8
    one = kept[kept["seed"] == 1]
    assert r("seed1")["n"] == 6
    assert r("seed1")["r"] == pytest.approx(np.corrcoef(one["alpha0"], one["mean_return"])[0, 1])
    assert r("published")["r"] == pytest.approx(0.910, abs=5e-4)
    assert r("published", "success_rate")["r"] == pytest.approx(0.369, abs=5e-4)
    assert set(frame["protocol"]) == {"released"}


def test_agreement_is_welchs_test_with_holm_over_the_measures():
    ours = synthetic.runs([("standard", variant, 500_000, 1.0) for variant in ("l2", "none")], 8)
    frame = agreement_frame(ours, peers(0.5)).set_index("metric")
    none = ours[ours["variant"] == "none"]["success_rate"]
    theirs = peers(0.5)["success_rate"]
    row = frame.loc["success_rate"]
    assert row["difference"] == pytest.approx(none.mean() - theirs.mean())
    assert row["p"] == pytest.approx(scipy_stats.ttest_ind(none, theirs, equal_var=False).pvalue)
    assert row["p_holm"] == pytest.approx(row["p"] * len(AGREEMENT_METRICS))
    assert (row["our_seeds"], row["their_seeds"]) == (8, 5)
    assert row["p_holm"] < 0.05 < frame.drop(index="success_rate")["p_holm"].min()


def test_no_agreement_is_claimed_at_another_budget():
    ours = synthetic.runs([("standard", "none", 1_000_000, 1.0)], 4)
    assert agreement_frame(ours, peers()).empty
