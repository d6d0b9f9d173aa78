"""Figures show the numbers of their tables, on any grid, with the same bytes every time."""

import drawn
import numpy as np
import pandas as pd
import pytest
import synthetic

from reacher_shaping.analysis import learning_curves
from reacher_shaping.figures import paper
from reacher_shaping.figures.style import to_bytes
from reacher_shaping.labels import number
from reacher_shaping.report import paper_tables

GRIDS = {"paper": (synthetic.PAPER_GRID, 3), "toy": (synthetic.TOY_GRID, 2)}
NO_L2SQ = synthetic.PAPER_GRID[:12]


@pytest.fixture(scope="module")
def paper_curves():
    return learning_curves.curve_table(synthetic.progress(synthetic.PAPER_GRID, seeds=3))


@pytest.fixture(scope="module")
def published():
    return synthetic.published()


def test_curve_table_has_mean_and_t_interval_over_seeds():
    progress = synthetic.progress([("paper", "none", 4096, 1.0)], seeds=3)
    progress["episode_return"] = [1.0, 2.0, 2.0, 4.0, 6.0, 12.0]  # seeds 0, 1, 2 at iterations 1, 2
    table = learning_curves.curve_table(progress)
    assert table["episode_return"].tolist() == [3.0, 6.0]
    # t quantile 4.3027 at two degrees of freedom; standard errors sqrt(7/3) and sqrt(28/3).
    half = 4.302652729911275 * np.sqrt([7 / 3, 28 / 3])
    np.testing.assert_allclose(table["high"] - table["episode_return"], half)
    np.testing.assert_allclose(table["episode_return"] - table["low"], half)
    assert table["seeds"].tolist() == [3, 3]


def test_curve_table_counts_only_finite_returns_and_gives_one_seed_no_band():
    progress = synthetic.progress([("paper", "none", 4096, 1.0)], seeds=2)
    progress.loc[progress["seed"] == 1, "episode_return"] = [np.nan, -np.inf]
    table = learning_curves.curve_table(progress)
    assert table["seeds"].tolist() == [1, 1]
    assert table["episode_return"].tolist() == progress["episode_return"].tolist()[:2]
    assert table[["low", "high"]].isna().all(axis=None)


def test_figure_1_has_the_papers_panels_and_reference(paper_curves):
    figure = paper.figure_1(paper_curves)
    assert len(figure.axes) == 6
    shown = [sorted(drawn.curves(axes, synthetic.MAIN)) for axes in figure.axes]
    constant, decay = ["l2", "l2sq"], ["decay200k", "decay300k", "decay500k"]
    assert shown == [[*constant, "none"]] * 2 + [constant] + [[*decay, "none"]] * 2 + [decay]
    line = drawn.curves(figure.axes[4], synthetic.MAIN)["decay300k"]
    cell = paper_curves.query("variant == 'decay300k' and budget == 1_000_000")
    np.testing.assert_array_equal(line.get_ydata(), cell["episode_return"])
    np.testing.assert_array_equal(line.get_xdata(), np.arange(1, 490))


@pytest.mark.parametrize("draw", [paper.figure_1, paper.figure_4])
def test_dashed_line_and_its_number_are_the_maximum_of_the_panel(paper_curves, draw):
    for axes in draw(paper_curves).axes:
        highest = max(line.get_ydata().max() for line in drawn.data_lines(axes))
        (dashed,) = drawn.labelled(axes, "_maximum")
        assert set(dashed.get_ydata()) == {highest}
        owner = next(line for line in drawn.data_lines(axes) if line.get_ydata().max() == highest)
        (text,) = [text for text in axes.texts if text.get_text().startswith("max")]
        assert text.get_text() == f"max {number(highest, 2)}"
        assert text.get_color() == owner.get_color()


def test_figure_2_bars_intervals_and_published_marks_stand_at_their_values(published):
    cells = synthetic.cells(synthetic.PAPER_GRID)
    figure = paper.figure_2(cells, published)
    main, appendix = figure.axes
    assert [len(axes.patches) for axes in figure.axes] == [17, 6]
    heights = sorted(bar.get_height() for axes in figure.axes for bar in axes.patches)
    assert heights == sorted(cells["success_rate"])
    for axes in (main, appendix):
        tops = {bar.get_x() + bar.get_width() / 2: bar.get_height() for bar in axes.patches}

        def at(x, tops=tops):
            return tops[min(tops, key=lambda middle: abs(middle - x))]

        intervals = drawn.segments(axes)
        assert len(intervals) == 2 * len(tops), "each interval and its white ground"
        for (x, low), (_, high) in intervals:
            row = cells[cells["success_rate_high"] == high].iloc[0]
            assert (low, at(x)) == (row["success_rate_low"], row["success_rate"])
    marks = [place for axes in figure.axes for place in drawn.points(axes)]
    assert sorted(y for _, y in marks) == sorted(published["success_rate"])
    (best,) = [x for x, y in drawn.points(main) if y == 0.258]
    bar = min(main.patches, key=lambda bar: abs(bar.get_x() + bar.get_width() / 2 - best))
    cell = cells.query("variant == 'decay300k' and budget == 1_000_000").iloc[0]
    assert bar.get_height() == cell["success_rate"]


def test_figure_2_draws_controllers_and_names_those_off_the_scale(published):
    controllers = synthetic.controllers()
    figure = paper.figure_2(synthetic.cells(synthetic.PAPER_GRID), published, controllers=controllers)
    lines = [line.get_ydata()[0] for line in drawn.labelled(figure.axes[0], "_controller")]
    assert lines == [0.002, 0.17, 0.2]
    assert "inverse kinematics + PD\n(100 %, off the scale)" in [text.get_text() for text in figure.axes[1].texts]


def test_figure_3_shows_each_coefficient_on_both_sides_of_the_diagonal():
    figure = paper.figure_3(synthetic.correlation(), synthetic.correlation(r=(0, 0.910, 0, 0.369, 0.305, 0)))
    ours, theirs = figure.axes[:2]
    matrix = ours.collections[0].get_array().reshape(4, 4)
    assert matrix[0, 2] == matrix[2, 0] == 0.91
    assert matrix[1, 3] == 0.3
    assert matrix.diagonal().tolist() == [1, 1, 1, 1]
    assert theirs.collections[0].get_array().reshape(4, 4)[1, 2] == 0.369
    assert "0.91\n0.71 to 0.96" in [text.get_text() for text in ours.texts]


def test_undefined_correlation_is_said():
    figure = paper.figure_3(synthetic.correlation(r=(np.nan, 0.9, np.nan, 0.3, np.nan, np.nan)))
    assert [text.get_text() for text in figure.axes[0].texts].count("not\ndefined") == 8


def test_figure_4_has_a_panel_per_budget(paper_curves):
    figure = paper.figure_4(paper_curves)
    assert [len(drawn.data_lines(axes)) for axes in figure.axes] == [3, 3]


@pytest.mark.parametrize(("grid", "seeds"), [*GRIDS.values(), (NO_L2SQ, 1), ([], 0)], ids=[*GRIDS, "main", "none"])
def test_every_grid_can_be_drawn(published, grid, seeds):
    cells, progress = synthetic.cells(synthetic.TOY_GRID, 2), synthetic.progress(synthetic.TOY_GRID, 2)
    empty = cells.iloc[:0], learning_curves.curve_table(progress).iloc[:0]
    cells, table = (
        (synthetic.cells(grid, seeds), learning_curves.curve_table(synthetic.progress(grid, seeds))) if grid else empty
    )
    figures = [
        paper.figure_1(table),
        paper.figure_2(cells, published, controllers=synthetic.controllers()),
        paper.figure_4(table),
    ]
    for figure in figures:
        assert to_bytes(figure, "png").startswith(b"\x89PNG")
    texts = {text.get_text() for figure in figures for axes in figure.axes for text in axes.texts}
    assert ("not in this study" in texts) == (grid is not synthetic.PAPER_GRID)


def test_one_protocol_is_drawn(published):
    ours = synthetic.cells(synthetic.TOY_GRID, 2)
    other = ours.assign(protocol="released", success_rate=0.9, success_rate_low=0.8, success_rate_high=1.0)
    both = pd.concat([ours, other])
    heights = [bar.get_height() for bar in paper.figure_2(both, published, "released").axes[0].patches]
    assert heights == [0.9, 0.9, 0.9]
    assert len(paper_tables.table_2(both, published, "released")) == len(ours)
