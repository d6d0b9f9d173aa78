"""What is said of power, variance and the lottery follows from their tables."""

import inspect

import numpy as np
import pandas as pd
import pytest
import synthetic

from reacher_shaping import stats
from reacher_shaping.analysis import comparisons, single_seed_studies
from reacher_shaping.report import seed_uncertainty

CELLS = [("paper", "decay300k", 1_000_000, 1.0), ("paper", "l2", 500_000, 0.5), ("paper", "l2", 500_000, 1.0)]


@pytest.fixture
def power():
    frame = pd.DataFrame(CELLS, columns=synthetic.CELL)
    return frame.assign(
        published_gain=[0.151, -0.029, 0.111], deviation=[0.1, 0.05, 0.02], seeds=5, power=[0.5, 0.1, 0.9],
        power_3=[0.2, 0.05, 0.85], seeds_needed=[12.0, np.nan, 3.0],
    )  # fmt: skip


@pytest.fixture
def variance():
    return pd.DataFrame(CELLS, columns=synthetic.CELL).assign(
        seeds=5, seed_variance=[0.0081, 0.0004, 0.0003], evaluation_variance=[0.0001, 0.0001, 0.0001]
    )


def test_power_rows_stand_by_variant_with_their_numbers(power):
    rows = seed_uncertainty.power_grid(power).rows
    assert rows[0] == ["L2, 500K, α₀ = 1", "11.1", "2.0", "5", "0.90", "0.85", "3"]
    assert rows[1] == ["L2, 500K, α₀ = 0.5", "\N{MINUS SIGN}2.9", "5.0", "5", "0.10", "0.05", "over 10,000"]
    assert rows[2][-1] == "12"


def test_power_sentence_counts_cells_and_takes_the_middle_one(power):
    text = seed_uncertainty.power_sentence(power)
    assert "with the 5 seeds of this study" in text
    assert "0.8 or more in 1 of 3 cells, and with 3 seeds in 1; the median cell takes 12 seeds" in text
    few = power.assign(seeds_needed=[np.nan, np.nan, 3.0], power=[0.8, 0.1, 0.9])
    assert "in 2 of 3 cells" in seed_uncertainty.power_sentence(few)
    assert "takes more than 10,000 seeds" in seed_uncertainty.power_sentence(few)


def test_power_that_is_unknown_is_said(power):
    unknown = power.assign(deviation=np.nan, power=np.nan, power_3=np.nan, seeds_needed=np.nan)
    assert "cannot be said" in seed_uncertainty.power_sentence(unknown)
    assert {row[-1] for row in seed_uncertainty.power_grid(unknown).rows} == {"\N{EN DASH}"}
    assert "cannot be said" in seed_uncertainty.power_sentence(power.iloc[:0])


def test_limits_are_those_of_the_statistics():
    parameters = inspect.signature(stats.seeds_needed).parameters
    assert (parameters["target"].default, parameters["most"].default) == (seed_uncertainty.POWER, seed_uncertainty.MOST)


def test_variance_is_shown_as_deviations_and_share(variance):
    rows = seed_uncertainty.variance_grid(variance).rows
    assert rows[2] == ["decay 300K, 1M, α₀ = 1", "5", "9.0", "1.0", "99\N{NO-BREAK SPACE}%"]
    assert rows[0][-1] == "75\N{NO-BREAK SPACE}%"


def test_variance_sentence_says_what_would_narrow_the_intervals(variance):
    text = seed_uncertainty.variance_sentence(variance).replace("\N{NO-BREAK SPACE}", " ")
    assert "In the median cell 80 % of the variance" in text
    assert "(75 % to 99 %)" in text
    assert "more seeds, rather than more evaluation episodes" in text
    noisy = variance.assign(evaluation_variance=0.01)
    assert "more evaluation episodes, rather than more seeds" in seed_uncertainty.variance_sentence(noisy)
    assert "cannot tell" in seed_uncertainty.variance_sentence(variance.assign(seed_variance=np.nan))


def test_winners_are_listed_and_the_first_is_named():
    winners = pd.DataFrame(
        {"variant": ["l2", "none"], "budget": [1_000_000] * 2, "alpha0": [1.0] * 2, "share": [0.625, 0.375]}
    )
    assert seed_uncertainty.winners_grid(winners).rows[0] == ["L2, 1M, α₀ = 1", "62.5\N{NO-BREAK SPACE}%"]
    text = seed_uncertainty.winners_sentence(winners)
    assert "2 cells could have come out best" in text
    assert "L2, 1M, α₀ = 1, in 62.5" in text
    assert "lacks" in seed_uncertainty.winners_sentence(winners.iloc[:0])


def test_spread_stands_beside_what_the_paper_reports():
    levels = {f"q{level:02d}": [level / 100] * 5 for level in (5, 25, 50, 75, 95)}
    quantities = ["best_success", "ratio", *single_seed_studies.CORRELATIONS]
    grid = seed_uncertainty.spread_grid(pd.DataFrame({"quantity": quantities} | levels), synthetic.published())
    assert grid.headings == ["Quantity", "5 %", "25 %", "50 %", "75 %", "95 %", "published"]
    assert grid.rows[0] == ["Success of the best cell (%)", "5.00", "25.00", "50.00", "75.00", "95.00", "25.80"]
    assert [row[-1] for row in grid.rows[1:]] == ["2.41", "0.91", "0.37", "0.30"]  # recomputed from Table 2


def test_tables_of_a_study_can_be_shown():
    runs = synthetic.runs(synthetic.PAPER_GRID, 4)
    power = comparisons.power_frame(runs, synthetic.published())
    assert len(seed_uncertainty.power_grid(power).rows) == len(power) == 21
    assert len(seed_uncertainty.variance_grid(comparisons.variance_frame(runs)).rows) == 23
    studies = single_seed_studies.single_seed_studies(runs, np.random.default_rng(0), 200)
    assert len(seed_uncertainty.spread_grid(single_seed_studies.spread_frame(studies), synthetic.published()).rows) == 5
    nothing = single_seed_studies.single_seed_studies(runs.iloc[:4], np.random.default_rng(0), 200)
    assert seed_uncertainty.winners_grid(single_seed_studies.winners_frame(nothing)).rows == []
    empty = seed_uncertainty.spread_grid(single_seed_studies.spread_frame(nothing), synthetic.published())
    assert empty.rows[0][1:6] == ["\N{EN DASH}"] * 5
