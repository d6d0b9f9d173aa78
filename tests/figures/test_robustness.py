"""The figures beyond the paper's show the numbers of their tables and survive an empty one."""

import pandas as pd
import pytest
import synthetic

from reacher_shaping.figures import robustness
from reacher_shaping.figures.style import variant_color

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


def _values(axes, label, coordinate="x"):
    return [getattr(line, f"get_{coordinate}data")()[0] for line in axes.lines if line.get_label() == label]


def test_seed_strip_has_a_dot_per_run_and_a_bar_at_each_mean(cells):
    runs = synthetic.runs(GRID, 3)
    axes = robustness.seed_strip(runs, cells, synthetic.published()).axes[0]
    dots = [x for line in axes.lines if line.get_label() == "_runs" for x in line.get_xdata()]
    assert sorted(dots) == sorted(runs["success_rate"])
    assert sorted(_values(axes, "_mean")) == sorted(cells["success_rate"])
    assert _values(axes, "_published") == [0.112, 0.107, 0.223, 0.253]
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert names[0] == "none · 500K, α₀ = 1"


def test_run_that_diverged_is_a_cross_at_its_value():
    figure, axes = _diverged("success_rate")
    crosses = [line for line in axes.lines if line.get_label() == "_diverged"]
    assert [(line.get_xdata()[0], line.get_ydata()[0]) for line in crosses] == [(0.0, 2), (0.0, 3)]
    dots = [x for line in axes.lines if line.get_label() == "_runs" for x in line.get_xdata()]
    assert len(dots) == 10
    assert "diverged" in [text.get_text() for text in figure.legends[0].get_texts()]


def test_run_without_a_value_is_a_cross_at_the_edge():
    _, axes = _diverged("mean_return")
    crosses = [line for line in axes.lines if line.get_label() == "_diverged"]
    assert [line.get_ydata()[0] for line in crosses] == [2, 3]
    assert all(line.get_transform() == axes.get_yaxis_transform() for line in crosses)
    assert all(0 <= line.get_xdata()[0] < 0.05 for line in crosses)
    runs = synthetic.diverge(synthetic.diverge(synthetic.runs(GRID, 3)), seed=0)
    axes = robustness.seed_strip(runs, synthetic.summary(runs), metric="mean_return").axes[0]
    assert [text.get_text() for text in axes.texts] == ["2 runs", "2 runs"]


def test_no_run_diverged_leaves_no_cross_and_no_legend_entry(cells):
    figure = robustness.seed_strip(synthetic.runs(GRID, 3), cells)
    assert not [line for line in figure.axes[0].lines if line.get_label() == "_diverged"]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["one seed", "mean and interval"]


def test_forest_shows_differences_and_fills_only_those_clear_of_zero(comparisons):
    axes = robustness.forest(comparisons).axes[0]
    marks = [line for line in axes.lines if line.get_label() == "_difference"]
    assert [line.get_xdata()[0] for line in marks] == [0.01, -0.05]
    assert marks[0].get_markerfacecolor() == "white"
    assert marks[1].get_markerfacecolor() == variant_color("decay200k")
    assert [text.get_text() for text in axes.texts] == ["0.400", "< 0.001", "p (Holm)"]
    assert [label.get_text() for label in axes.get_yticklabels()][1] == "decay 200K · 500K, α₀ = 0.5"
    assert axes.get_xlabel() == "Paired difference in success rate: less none, same seeds"


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
    line = next(line for line in axes.lines if line.get_label() == "L2")
    assert line.get_xdata().tolist() == [10.0, 20.0]
    assert line.get_ydata()[0] == cells.query("variant == 'l2' and budget == 500_000")["success_rate"].item()
    assert _values(axes, "_radius") == [20.0]


def test_lottery_bars_are_the_shares():
    frame = pd.DataFrame({"statement": ["one", "other"], "share": [0.125, 0.5]})
    axes = robustness.lottery(frame).axes[0]
    assert [bar.get_width() for bar in axes.patches] == [0.125, 0.5]
    assert [text.get_text() for text in axes.texts] == ["12.5 %", "50.0 %"]


def test_long_episodes_have_a_line_per_variant(cells):
    frame = pd.concat([cells.assign(steps=steps) for steps in (50, 200)])
    figure = robustness.long_episodes(frame)
    assert [len(axes.lines) for axes in figure.axes] == [2, 2]


def test_setting_without_an_unshaped_cell_borrows_that_of_its_budget():
    grid = [("paper", "none", 500_000, 1.0), ("paper", "l2", 500_000, 1.0), ("paper", "l2", 500_000, 0.5)]
    frame = synthetic.over(grid, 3, "steps", (50, 200))
    whole, half = robustness.long_episodes(frame).axes
    assert [line.get_linestyle() for line in whole.lines] == ["-", "-"]
    dashed = next(line for line in half.lines if line.get_linestyle() == "--")
    solid = next(line for line in whole.lines if line.get_label() == "none")
    assert dashed.get_ydata().tolist() == solid.get_ydata().tolist()


def test_many_settings_stand_in_two_columns():
    figure = robustness.success_by_radius(synthetic.over(synthetic.PAPER_GRID, 3, "radius", (0.01, 0.02)))
    assert [axes.get_title(loc="left") for axes in figure.axes] == [
        "500K, α₀ = 1", "1M, α₀ = 1", "500K, α₀ = 0.5", "1M, α₀ = 0.5",
    ]  # fmt: skip
    assert figure.axes[0].get_gridspec().ncols == 2


def test_lottery_statements_are_shown_without_marks():
    axes = robustness.lottery(pd.DataFrame({"statement": ["alpha0 above `none`"], "share": [0.5]})).axes[0]
    assert axes.get_yticklabels()[0].get_text() == "α₀ above none"


def test_empty_tables_are_said_to_be_empty(cells, comparisons):
    runs = synthetic.runs(GRID, 3)
    empty = cells.iloc[:0].assign(radius=[], mode=[], steps=[])
    for figure in (
        robustness.seed_strip(runs.iloc[:0], cells.iloc[:0]),
        robustness.forest(comparisons.iloc[:0]),
        robustness.success_by_radius(empty),
        robustness.long_episodes(empty),
        robustness.lottery(pd.DataFrame({"statement": [], "share": []})),
    ):
        assert [text.get_text() for text in figure.axes[0].texts] == ["not in this study"]
