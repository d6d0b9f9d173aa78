"""The figures beyond the paper's show the numbers of their tables and survive an empty one."""

import drawn
import numpy as np
import pandas as pd
import pytest
import synthetic

from reacher_shaping.figures import robustness

GRID = synthetic.PAPER_GRID[:4]


@pytest.fixture(scope="module")
def cells():
    return synthetic.cells(GRID, 3)


@pytest.fixture(scope="module")
def comparisons():
    rows = [
        {"variant": variant, "budget": 500_000, "alpha0": alpha0, "other_variant": "none", "other_budget": 500_000,
         "other_alpha0": 1.0, "difference": difference, "ci_low": difference - 0.03, "ci_high": difference + 0.03,
         "p_holm": p, "protocol": "paper", "family": "none", "metric": "success_rate"}
        for variant, alpha0, difference, p in (("l2", 1.0, 0.01, 0.4), ("decay200k", 0.5, -0.05, 0.0004))
    ]  # fmt: skip
    return pd.DataFrame(rows)


def _diverged(metric):
    runs = synthetic.diverge(synthetic.runs(GRID, 3))
    figure = robustness.seed_strip(runs, synthetic.summary(runs), metric=metric)
    return figure, figure.axes[0]


def test_seed_strip_has_a_dot_per_run_and_a_bar_at_each_mean(cells):
    runs = synthetic.runs(GRID, 3)
    axes = robustness.seed_strip(runs, cells, synthetic.published()).axes[0]
    assert sorted(x for x, _ in drawn.runs(axes)) == sorted(runs["success_rate"])
    intervals = sorted(tuple(ends[:, 0]) for ends in drawn.segments(axes))
    assert intervals == sorted(zip(cells["success_rate_low"], cells["success_rate_high"], strict=True))
    marks = drawn.points(axes)
    rows = [label.get_text() for label in axes.get_yticklabels()]
    assert rows == ["none · 500K, α₀ = 1", "none · 1M, α₀ = 1", "L2 · 500K, α₀ = 1", "L2 · 1M, α₀ = 1"]
    means = cells["success_rate"].tolist()
    assert sorted(marks) == sorted([*zip(means, range(4), strict=True), (0.112, 0), (0.107, 1), (0.223, 2), (0.253, 3)])


def _crosses(axes):
    return drawn.points(axes, "#b00020")


def test_run_that_diverged_is_a_cross_at_its_value():
    figure, axes = _diverged("success_rate")
    assert _crosses(axes) == [(0.0, 2), (0.0, 3)]
    assert len(drawn.runs(axes)) == 10
    assert "diverged" in [text.get_text() for text in figure.legends[0].get_texts()]


def test_run_without_a_value_is_a_cross_at_the_edge():
    _, axes = _diverged("mean_return")
    crosses = drawn.labelled(axes, "_diverged")
    assert sorted(line.get_ydata()[0] for line in crosses) == [2, 3]
    assert all(line.get_transform() == axes.get_yaxis_transform() for line in crosses)
    assert all(0 <= line.get_xdata()[0] < 0.05 for line in crosses)
    runs = synthetic.diverge(synthetic.diverge(synthetic.runs(GRID, 3)), seed=0)
    axes = robustness.seed_strip(runs, synthetic.summary(runs), metric="mean_return").axes[0]
    assert [text.get_text() for text in axes.texts] == ["2 runs", "2 runs"]


def test_no_run_diverged_leaves_no_cross_and_no_legend_entry(cells):
    figure = robustness.seed_strip(synthetic.runs(GRID, 3), cells)
    assert not _crosses(figure.axes[0])
    assert not drawn.labelled(figure.axes[0], "_diverged")
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["one seed", "mean and interval"]


def test_forest_shows_differences_and_fills_only_those_clear_of_zero(comparisons):
    axes = robustness.forest(comparisons).axes[0]
    assert drawn.filled(axes) == [(0.01, 0, False), (-0.05, 1, True)]
    np.testing.assert_allclose([ends[:, 0] for ends in drawn.segments(axes)], [[-0.02, 0.04], [-0.08, -0.02]])
    assert [text.get_text() for text in axes.texts] == ["0.400", "< 0.001", "p (Holm)"]
    assert [label.get_text() for label in axes.get_yticklabels()][1] == "decay 200K · 500K, α₀ = 0.5"
    assert axes.get_xlabel() == "Paired difference in success rate, percentage points: less none, same seeds"


def test_forest_of_several_partners_names_each(comparisons):
    mixed = comparisons.assign(other_variant=["none", "l2"])
    axes = robustness.forest(mixed).axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()] == [
        "L2 · 500K, α₀ = 1  less  none",
        "decay 200K · 500K, α₀ = 0.5  less  L2",
    ]


def test_success_against_radius_is_drawn_in_millimetres(cells):
    radii = pd.concat([cells.assign(radius=radius, mode="stochastic") for radius in (0.01, 0.02)])
    axes = robustness.success_by_radius(radii, radius=0.02).axes[0]
    line = drawn.curves(axes, synthetic.MAIN)["l2"]
    assert line.get_xdata().tolist() == [0.01, 0.02]
    assert [axes.xaxis.get_major_formatter()(place) for place in line.get_xdata()] == ["10", "20"]
    assert line.get_ydata()[0] == cells.query("variant == 'l2' and budget == 500_000")["success_rate"].item()
    assert drawn.labelled(axes, "_radius")[0].get_xdata()[0] == 0.02


def test_lottery_bars_are_the_shares():
    frame = pd.DataFrame({"statement": ["one", "other"], "share": [0.125, 0.5]})
    axes = robustness.lottery(frame).axes[0]
    assert [bar.get_width() for bar in axes.patches] == [0.125, 0.5]
    assert [text.get_text() for text in axes.texts] == ["12.5 %", "50.0 %"]


def test_long_episodes_have_a_line_per_variant(cells):
    frame = pd.concat([cells.assign(steps=steps) for steps in (50, 200)])
    figure = robustness.long_episodes(frame)
    assert [len(drawn.data_lines(axes)) for axes in figure.axes] == [2, 2]


def test_setting_without_an_unshaped_cell_borrows_that_of_its_budget():
    grid = [("paper", "none", 500_000, 1.0), ("paper", "l2", 500_000, 1.0), ("paper", "l2", 500_000, 0.5)]
    frame = synthetic.over(grid, 3, "steps", (50, 200))
    whole, half = (drawn.curves(axes, synthetic.MAIN) for axes in robustness.long_episodes(frame).axes)
    assert not any(map(drawn.dashed, whole.values()))
    assert drawn.dashed(half["none"])
    assert half["none"].get_ydata().tolist() == whole["none"].get_ydata().tolist()


def test_unshaped_cell_that_has_only_a_weight_of_its_own_stands_with_the_shaped_one():
    grid = [("tuned", "none", 500_000, 1.0), ("tuned", "l2", 500_000, 3.6)]
    (axes,) = robustness.long_episodes(synthetic.over(grid, 3, "steps", (50, 200))).axes
    assert axes.get_title(loc="left") == "500K, α₀ = 3.6"
    assert not any(map(drawn.dashed, drawn.data_lines(axes)))


def test_probability_of_improvement_is_filled_where_one_half_is_left_out(comparisons):
    chances = {"improvement": [0.55, 0.2], "improvement_low": [0.4, 0.1], "improvement_high": [0.7, 0.3]}
    axes = robustness.improvement(comparisons.assign(**chances)).axes[0]
    assert drawn.filled(axes) == [(0.55, 0, False), (0.2, 1, True)]
    assert axes.get_xlabel() == "Probability that a run has the higher success rate than one of none"


def test_peers_have_a_dot_per_seed_in_both_panels():
    runs, cells = synthetic.runs(synthetic.PAPER_GRID, 4), synthetic.cells(synthetic.PAPER_GRID, 4)
    controllers = synthetic.controllers()
    figure = robustness.peers(synthetic.peers(), runs, cells, controllers)
    none = runs[runs["variant"] == "none"]
    for axes, metric in zip(figure.axes, ("success_rate", "mean_return"), strict=True):
        assert sorted(x for x, _ in drawn.runs(axes)) == sorted([*synthetic.peers()[metric], *none[metric]])
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()] == [
        "PPO · 500K", "SAC · 100K", "TD3 · 100K", "none (this study) · 500K", "none (this study) · 1M",
        "inverse kinematics + PD",
    ]  # fmt: skip


def test_many_settings_stand_in_two_columns():
    figure = robustness.success_by_radius(synthetic.over(synthetic.PAPER_GRID, 3, "radius", (0.01, 0.02)))
    assert [axes.get_title(loc="left") for axes in figure.axes] == [
        "500K, α₀ = 1", "1M, α₀ = 1", "500K, α₀ = 0.5", "1M, α₀ = 0.5",
    ]  # fmt: skip
    assert figure.axes[0].get_gridspec().ncols == 2


def test_lottery_statements_are_shown_without_marks():
    axes = robustness.lottery(pd.DataFrame({"statement": ["alpha0 of `l2sq` above `none`"], "share": [0.5]})).axes[0]
    assert axes.get_yticklabels()[0].get_text() == "α₀ of L2² above none"


def test_empty_tables_are_said_to_be_empty(cells, comparisons):
    runs = synthetic.runs(GRID, 3)
    empty = cells.iloc[:0].assign(radius=[], mode=[], steps=[])
    for figure in (
        robustness.seed_strip(runs.iloc[:0], cells.iloc[:0]),
        robustness.forest(comparisons.iloc[:0]),
        robustness.peers(synthetic.peers().iloc[:0], runs, cells),
        robustness.success_by_radius(empty),
        robustness.long_episodes(empty),
        robustness.lottery(pd.DataFrame({"statement": [], "share": []})),
    ):
        assert [text.get_text() for text in figure.axes[0].texts] == ["not in this study"]
