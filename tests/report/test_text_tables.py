"""Tables as text: what is counted is said, and the numbers are those of the tables."""

from pathlib import Path

import synthetic

from reacher_shaping.report import paper_tables, text_tables
from reacher_shaping.settings.study import load_study, read_settings

CONFIG = Path(__file__).parents[2] / "config.yaml"


def test_seeds_are_counted_per_variant_and_setting():
    grid = text_tables.study_grid(synthetic.cells(synthetic.PAPER_GRID, 4))
    assert grid.headings == ["Variant", "500K, α₀ = 1", "1M, α₀ = 1", "500K, α₀ = 0.5", "1M, α₀ = 0.5"]
    assert grid.rows[0] == ["none", "4", "4", "", ""]
    assert grid.rows[-1] == ["decay 500K, L2²", "", "", "4", "4"]


def test_diverged_runs_stand_beside_the_seeds():
    runs = synthetic.diverge(synthetic.runs(synthetic.TOY_GRID, 3))
    assert [row[1] for row in text_tables.study_grid(synthetic.summary(runs)).rows] == ["3", "3 (1 diverged)", "3"]


def test_grid_of_a_table_is_its_readable_form():
    table = paper_tables.behaviour(synthetic.cells(synthetic.TOY_GRID, 3))
    grid = text_tables.of_table(table)
    assert grid.rows == paper_tables.readable(table).to_numpy().tolist()
    assert grid.texts == {0}


def test_markdown_has_a_line_per_row_and_says_when_there_is_none():
    grid = text_tables.Grid(["Variant", "Seeds"], [["L2", "3"]])
    assert text_tables.to_markdown(grid) == "| Variant | Seeds |\n| :-- | --: |\n| L2 | 3 |"
    assert text_tables.to_markdown(text_tables.Grid(["Variant", "Seeds"], [])).endswith(
        "| No such cells in this study. |  |"
    )


def test_every_source_that_the_configuration_gives_stands_beside_its_setting():
    grid = text_tables.settings_grid(load_study(CONFIG).model_dump(mode="json"))
    rows = {row[0]: dict(zip(grid.headings[1:], row[1:], strict=True)) for row in grid.rows}
    given = [
        (f"{part}: {key}".replace("_", " "), name.replace("_", " "), value["source"])
        for name, protocol in read_settings(CONFIG)["protocols"].items()
        for part, settings in protocol.items()
        if part != "from"
        for key, value in settings.items()
    ]
    assert len(given) > 50
    assert [one for one in given if not rows[one[0]][one[1]].endswith(f" ({one[2]})")] == []
    assert rows["ppo: discount"]["released"] == "0.99 (paper 3.2)", "taken over from the protocol that it comes from"
    assert rows["environment: success radius"]["paper"] == "not set"
