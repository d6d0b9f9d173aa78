"""Tables hold our values, their intervals and the published ones, ranked by success rate."""

import io

import pandas as pd
import pytest
import synthetic

from reacher_shaping.analysis.scores import scores_frame
from reacher_shaping.report import paper_tables


@pytest.fixture(scope="module")
def published():
    return synthetic.published()


@pytest.fixture(scope="module")
def cells():
    return synthetic.cells(synthetic.PAPER_GRID)


def test_published_rows_come_under_our_keys(published):
    assert set(zip(published["variant"], published["budget"], published["alpha0"], strict=True)) == {
        key[1:] for key in synthetic.PAPER_GRID
    }
    best = published.query("variant == 'decay300k' and budget == 1_000_000").iloc[0]
    assert (best["success_rate"], best["mean_return"]) == (0.258, -67.56)
    appendix = published.query("variant == 'decay300k_l2sq' and budget == 1_000_000").iloc[0]
    assert (appendix["success_rate"], appendix["mean_return"]) == (0.207, -276.29)


def test_table_2_has_every_main_cell_once_best_first(cells, published):
    table = paper_tables.table_2(cells, published)
    assert len(table) == 17
    assert table["success_rate"].is_monotonic_decreasing
    assert table["rank"].tolist() == list(range(1, 18))
    assert sorted(table["published_rank"]) == list(range(1, 18))
    for row in table.to_dict("records"):
        where = (cells["variant"] == row["variant"]) & (cells["budget"] == row["budget"])
        cell = cells[where & (cells["alpha0"] == row["alpha0"])].iloc[0]
        for name in ("success_rate", "success_rate_low", "success_rate_high", "mean_return", "final_distance"):
            assert row[name] == cell[name]


def test_published_values_stand_beside_their_own_cell(cells, published):
    row = paper_tables.table_2(cells, published).query("variant == 'l2' and alpha0 == 0.5").iloc[0]
    assert (row["published_success_rate"], row["published_mean_return"], row["published_rank"]) == (0.083, -1177.37, 17)


def test_table_1_is_the_top_six_of_table_2(cells, published):
    pd.testing.assert_frame_equal(
        paper_tables.table_1(cells, published), paper_tables.table_2(cells, published).head(6)
    )


def test_table_3_has_the_six_appendix_cells_with_their_own_published_ranks(cells, published):
    table = paper_tables.table_3(cells, published)
    assert set(table["variant"]) == set(synthetic.L2SQ)
    assert sorted(table["published_rank"]) == [1, 2, 3, 4, 5, 6]


def test_equal_success_rates_share_a_rank(cells, published):
    table = paper_tables.table_2(cells.assign(success_rate=0.25), published)
    assert set(table["rank"]) == {1}


def test_csv_gives_the_numbers_back(cells, published):
    table = paper_tables.table_2(cells, published)
    again = pd.read_csv(io.StringIO(paper_tables.to_csv(table)))
    pd.testing.assert_frame_equal(again, table, check_dtype=False)


def test_markdown_reads_well(cells, published):
    cells = cells.assign(
        success_rate=0.25, success_rate_low=0.2, success_rate_high=0.304, mean_return=-10.126, mean_return_low=-11.0,
        mean_return_high=-9.0, final_distance=0.0456,
    )  # fmt: skip
    text = paper_tables.to_markdown(paper_tables.table_3(cells, published), "What it shows.").replace(
        "\N{MINUS SIGN}", "-"
    )
    lines = text.splitlines()
    assert lines[0] == "What it shows."
    row = next(line for line in lines if "| decay 300K, L2², 1M, α₀ = 0.5 |" in line)
    entries = [entry.strip() for entry in row.strip("|").split("|")]
    assert entries[2:8] == ["10", "25.0 [20.0, 30.4]", "20.7", "1", "-10.13 [-11.00, -9.00]", "-276.29"]
    assert entries[-1].startswith("45.6 [")
    assert len({line.count("|") for line in lines[2:]}) == 1


def test_toy_grid_has_no_published_values_and_says_so(published):
    toy = synthetic.cells(synthetic.TOY_GRID, 2)
    table = paper_tables.table_2(toy, published)
    assert table["published_success_rate"].isna().all()
    assert "| \N{EN DASH} |" in paper_tables.to_markdown(table, "Toy.")
    assert "No such cells in this study." in paper_tables.to_markdown(paper_tables.table_3(toy, published), "Toy.")


def test_diverged_runs_are_counted_where_people_look(cells, published):
    text = paper_tables.to_markdown(paper_tables.table_1(cells.assign(diverged=2), published), "Caption.")
    assert text.count("10 (2 diverged)") == 6


def test_behaviour_has_every_cell_by_variant_with_its_values(cells):
    table = paper_tables.behaviour(cells)
    assert len(table) == len(cells) == 23
    assert table["variant"].tolist()[:5] == ["none", "none", "l2", "l2", "l2"]
    assert table["alpha0"].tolist()[2:5] == [1.0, 1.0, 0.5]
    for name in ("final_success_rate", "first_hit_step_low", "reward_control_high"):
        merged = table.merge(cells, on=paper_tables.CELL, suffixes=("", "_given"))
        assert (merged[name] == merged[f"{name}_given"]).all(), name
    shown = paper_tables.readable(
        cells.iloc[:1].assign(share_within_radius=0.0456, share_within_radius_low=float("nan"))
    )
    assert shown["Steps within the radius (%)"].tolist() == ["4.6"]


def test_measure_that_an_older_table_lacks_is_left_out(cells):
    older = cells.drop(columns=[name for name in cells if "share_within_radius" in name])
    frame = paper_tables.readable(paper_tables.behaviour(older))
    assert "Steps within the radius (%)" not in frame
    assert "Success at the last step (%)" in frame
    assert "Steps within the radius (%)" in paper_tables.readable(paper_tables.behaviour(cells))


def test_learning_says_how_many_runs_reached_the_threshold(cells):
    runs = synthetic.runs(synthetic.PAPER_GRID)
    slow = (runs["variant"] == "l2sq") & (runs["seed"] < 3)
    runs.loc[slow, "steps_to_threshold"] = float("nan")
    table = paper_tables.learning(synthetic.summary(runs), runs)
    frame = paper_tables.readable(table).set_index("Setting")
    assert frame.loc["L2², 1M, α₀ = 1", "reached by"] == "7 of 10"
    assert frame.loc["none, 1M", "reached by"] == "10 of 10"
    assert frame.loc["L2², 1M, α₀ = 1", "Steps to the threshold (thousands)"].startswith("115 [")  # 2.048 (50 + 6)


def test_diverged_runs_are_counted_among_the_measures():
    runs = synthetic.diverge(synthetic.runs(synthetic.TOY_GRID, 3))
    for table in (
        paper_tables.behaviour(synthetic.summary(runs)),
        paper_tables.learning(synthetic.summary(runs), runs),
    ):
        assert paper_tables.readable(table).set_index("Setting")["Seeds"].to_dict() == {
            "none, 4,096": "3", "L2, 4,096, α₀ = 1": "3 (1 diverged)", "decay 200K, 4,096, α₀ = 1": "3",
        }  # fmt: skip


def test_a_cell_without_shaping_has_no_weight_unless_one_is_its_label():
    cell = {"variant": "none", "budget": 500_000}
    assert paper_tables.cell_label({**cell, "alpha0": 1.0}) == "none, 500K"
    assert paper_tables.cell_label({**cell, "alpha0": 0.5}) == "none, 500K, α₀ = 0.5"


def test_robust_measures_are_those_of_the_scores():
    scores = scores_frame(synthetic.runs(synthetic.PAPER_GRID, 5))
    frame = paper_tables.readable(paper_tables.robust(scores)).set_index("Setting")
    row = scores[(scores["variant"] == "l2") & (scores["budget"] == 1_000_000) & (scores["metric"] == "success_rate")]
    shown = frame.loc["L2, 1M, α₀ = 1"]
    assert shown["Success, IQM (%) [95 % interval]"].startswith(f"{100 * row['iqm'].iloc[0]:.1f} [")
    assert shown["Better than none in (%) [95 % interval]"].startswith(f"{100 * row['improvement'].iloc[0]:.0f} [")
    assert frame.loc["none, 1M", "Better than none in (%) [95 % interval]"] == "\N{EN DASH}"
    assert len(frame) == 23


def test_missing_interval_leaves_the_value_alone(cells, published):
    single = cells.assign(mean_return=-10.0, mean_return_low=float("nan"), mean_return_high=float("nan"))
    assert "| \N{MINUS SIGN}10.00 |" in paper_tables.to_markdown(paper_tables.table_1(single, published), "Caption.")


def test_save_writes_numbers_and_text(tmp_path, cells, published):
    paths = paper_tables.save(paper_tables.table_1(cells, published), "Caption.", tmp_path / "table_1")
    assert [path.name for path in paths] == ["table_1.csv", "table_1.md"]
    assert paths[1].read_text(encoding="utf-8").startswith("Caption.\n\n| Setting | Rank |")


def test_the_published_tables_and_the_run_they_leave_out_are_all_runs_of_the_release():
    names = ("table2.csv", "table3.csv", "left_out.csv")
    told = paper_tables.published_cells(*(pd.read_csv(synthetic.PUBLISHED / name) for name in names)).set_index("run")
    every = pd.read_csv(synthetic.PUBLISHED / "all_runs_radius_0.02.csv").set_index("run")
    assert sorted(told.index) == sorted(every.index)
    assert told["success_rate"].to_dict() == every["success_rate"].to_dict()
    assert told["mean_return"].to_dict() == every["mean_return"].round(2).to_dict()
