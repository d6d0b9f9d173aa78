"""Other algorithms are shown with their own seeds and budgets, beside the study's unshaped cells."""

import numpy as np
import pandas as pd
import pytest
import synthetic
from scipy import stats as scipy_stats

from reacher_shaping.analysis.baselines import peer_table
from reacher_shaping.report import paper_tables
from reacher_shaping.report.html import budgets_sentence


@pytest.fixture
def cells():
    return synthetic.cells(synthetic.PAPER_GRID, 4)


@pytest.fixture
def controllers():
    return synthetic.controllers().assign(protocol="paper", mode="stochastic", final_distance=0.0001)


def test_rows_are_the_peers_then_none_then_the_controller(cells, controllers):
    table = peer_table(synthetic.peers(), cells, controllers)
    names = [(row["policy"], row["budget"]) for row in table.iloc[:5].to_dict("records")]
    assert names == [
        ("PPO", 500_000), ("SAC", 100_000), ("TD3", 100_000),
        ("none (this study)", 500_000), ("none (this study)", 1_000_000),
    ]  # fmt: skip
    assert table["policy"].iloc[-1] == "inverse kinematics + PD"
    assert table["success_rate"].iloc[-1] == 1.0
    none = cells[(cells["variant"] == "none") & (cells["budget"] == 1_000_000)].iloc[0]
    for name in ("success_rate", "mean_return_low", "deterministic_success_rate"):
        assert table[name].iloc[4] == none[name]


def test_peers_have_the_t_interval_of_their_seeds(cells):
    row = peer_table(synthetic.peers(), cells).iloc[0]
    sample = np.array([-4.0, -5.0, -6.0])
    low, high = scipy_stats.t.interval(0.95, 2, sample.mean(), sample.std(ddof=1) / np.sqrt(3))
    assert (row["mean_return"], row["mean_return_low"], row["mean_return_high"]) == pytest.approx((-5.0, low, high))
    assert row["success_rate"] == pytest.approx(0.4)


def test_rates_stay_between_nothing_and_all(cells):
    table = peer_table(synthetic.peers(), cells)
    assert table.set_index("policy").loc["TD3", "success_rate_low"] == 0.0
    single = peer_table(synthetic.peers(1), cells).iloc[0]
    assert np.isnan(single["success_rate_low"])


def test_budgets_are_said_openly():
    said = budgets_sentence(synthetic.peers())
    assert said == "Environment steps of training: PPO 500K (3 seeds), SAC 100K (3 seeds), TD3 100K (3 seeds)."
    assert "SAC 100K (1 seed)" in budgets_sentence(synthetic.peers(1))


def test_peer_that_diverged_is_counted(cells):
    peers = synthetic.peers()
    peers.loc[peers["algorithm"] == "sac", "mean_return"] = [np.nan, -5.0, -6.0]
    table = peer_table(peers, cells)
    assert paper_tables.readable(table).set_index("Policy").loc["SAC", "Seeds"] == "3 (1 diverged)"
    assert table.set_index("policy").loc["SAC", "mean_return"] == -5.5


def test_study_without_an_unshaped_cell_shows_the_peers_alone(cells):
    table = peer_table(synthetic.peers(), cells[cells["variant"] != "none"])
    assert table["policy"].tolist() == ["PPO", "SAC", "TD3"]
    assert isinstance(table, pd.DataFrame)
