"""The figures beyond the paper's show the numbers of their tables and survive an empty one."""

import pandas as pd
import pytest
import synthetic

from reacher_shaping import further, style

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


def _values(axes, label, coordinate="x"):
    return [getattr(line, f"get_{coordinate}data")()[0] for line in axes.lines if line.get_label() == label]


def test_seed_strip_has_a_dot_per_run_and_a_bar_at_each_mean(cells):
    runs = synthetic.runs(GRID, 3)
    axes = further.seed_strip(runs, cells, synthetic.published()).axes[0]
    dots = [x for line in axes.lines if line.get_label() == "_runs" for x in line.get_xdata()]
    assert sorted(dots) == sorted(runs["success_rate"])
    assert sorted(_values(axes, "_mean")) == sorted(cells["success_rate"])
    assert _values(axes, "_published") == [0.112, 0.107, 0.223, 0.253]
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert names[0] == "none · 500K, α₀ = 1"


def test_forest_shows_differences_and_fills_only_those_clear_of_zero(comparisons):
    axes = further.forest(comparisons).axes[0]
    marks = [line for line in axes.lines if line.get_label() == "_difference"]
    assert [line.get_xdata()[0] for line in marks] == [0.01, -0.05]
    assert marks[0].get_markerfacecolor() == "white"
    assert marks[1].get_markerfacecolor() == style.variant_color("decay200k")
    assert [text.get_text() for text in axes.texts] == ["p = 0.400", "p < 0.001"]
    assert [label.get_text() for label in axes.get_yticklabels()][1] == "decay 200K · 500K, α₀ = 0.5  less  none"


def test_success_against_radius_is_drawn_in_millimetres(cells):
    radii = pd.concat([cells.assign(radius=radius, mode="stochastic") for radius in (0.01, 0.02)])
    axes = further.success_by_radius(radii, radius=0.02).axes[0]
    line = next(line for line in axes.lines if line.get_label() == "L2")
    assert line.get_xdata().tolist() == [10.0, 20.0]
    assert line.get_ydata()[0] == cells.query("variant == 'l2' and budget == 500_000")["success_rate"].item()
    assert _values(axes, "_radius") == [20.0]


def test_lottery_bars_are_the_shares():
    frame = pd.DataFrame({"statement": ["one", "other"], "share": [0.125, 0.5]})
    axes = further.lottery(frame).axes[0]
    assert [bar.get_width() for bar in axes.patches] == [0.125, 0.5]
    assert [text.get_text() for text in axes.texts] == ["12.5 %", "50.0 %"]


def test_long_episodes_have_a_line_per_variant(cells):
    frame = pd.concat([cells.assign(steps=steps) for steps in (50, 200)])
    figure = further.long_episodes(frame)
    assert [len(axes.lines) for axes in figure.axes] == [2, 2]


def test_empty_tables_are_said_to_be_empty(cells, comparisons):
    runs = synthetic.runs(GRID, 3)
    empty = cells.iloc[:0].assign(radius=[], mode=[], steps=[])
    for figure in (
        further.seed_strip(runs.iloc[:0], cells.iloc[:0]),
        further.forest(comparisons.iloc[:0]),
        further.success_by_radius(empty),
        further.long_episodes(empty),
        further.lottery(pd.DataFrame({"statement": [], "share": []})),
    ):
        assert [text.get_text() for text in figure.axes[0].texts] == ["not in this study"]
