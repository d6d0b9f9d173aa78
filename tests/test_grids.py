"""Tables as text: what is counted is said, and the numbers are those of the tables."""

import synthetic

from reacher_shaping import grids, tables


def test_seeds_are_counted_per_variant_and_setting():
    grid = grids.study_grid(synthetic.cells(synthetic.PAPER_GRID, 4))
    assert grid.headings == ["Variant", "500K, α₀ = 1", "1M, α₀ = 1", "500K, α₀ = 0.5", "1M, α₀ = 0.5"]
    assert grid.rows[0] == ["none", "4", "4", "", ""]
    assert grid.rows[-1] == ["decay 500K, L2²", "", "", "4", "4"]


def test_diverged_runs_stand_beside_the_seeds():
    runs = synthetic.diverge(synthetic.runs(synthetic.TOY_GRID, 3))
    assert [row[1] for row in grids.study_grid(synthetic.summary(runs)).rows] == ["3", "3 (1 diverged)", "3"]


def test_grid_of_a_table_is_its_readable_form():
    table = tables.behaviour(synthetic.cells(synthetic.TOY_GRID, 3))
    grid = grids.of_table(table)
    assert grid.rows == tables.readable(table).to_numpy().tolist()
    assert grid.texts == {0}


def test_markdown_has_a_line_per_row_and_says_when_there_is_none():
    grid = grids.Grid(["Variant", "Seeds"], [["L2", "3"]])
    assert grids.to_markdown(grid) == "| Variant | Seeds |\n| :-- | --: |\n| L2 | 3 |"
    assert grids.to_markdown(grids.Grid(["Variant", "Seeds"], [])).endswith("| no such cells in this study |  |")
