import json

import pytest

from reacher_shaping.jobs import cost
from reacher_shaping.settings.cell import PPO, Cell, Protocol, Variant
from reacher_shaping.settings.study import Evaluation

RATES = cost.Rates(training=1000.0, evaluation=500.0, start=2.0)


def cell(**ppo):
    return Cell(protocol=Protocol(name="test", ppo=PPO(**ppo)), variant=Variant(name="l2", potential="l2"), budget=4000)


def test_training_takes_its_whole_rollouts_at_the_rate():
    """4,000 steps are two rollouts of 2,048; three seeds of them at 1,000 steps/s, and the start."""
    assert cost.training_seconds(cell(), 3, RATES) == pytest.approx(2 + 3 * 2 * 2048 / 1000)


def test_more_epochs_and_networks_are_more_work():
    assert cost.work(PPO()) == pytest.approx(1)
    assert cost.work(PPO(epochs=20)) == pytest.approx(0.16 + 2 * 0.84)
    assert cost.work(PPO(networks="separate")) > cost.work(PPO())


def test_evaluation_counts_both_modes():
    assert cost.evaluation_seconds(Evaluation(episodes=10), 3, RATES) == pytest.approx(2 + 3 * 2 * 10 * 50 / 500)


def test_rates_are_those_of_the_blocks_that_are_there(tmp_path):
    folder = tmp_path / "results/test/l2/4000/alpha1/seeds0-2"
    folder.mkdir(parents=True)
    record = {
        "settings": {"cell": cell().settings()}, "env_steps": 12_288, "wall_seconds": 4.0,
        "evaluation": {"env_steps": 3000, "wall_seconds": 1.5},
    }  # fmt: skip
    (folder / "manifest.json").write_text(json.dumps(record))
    rates = cost.measured_rates(tmp_path / "results", tmp_path / "none.json")
    assert (rates.training, rates.evaluation) == (pytest.approx(3072), pytest.approx(2000))
    assert "the 1 blocks in" in rates.source
    assert rates.start == cost.Rates().start, "nothing tells"
    benchmark = tmp_path / "results/benchmarks/test/l2/4000/alpha1/seeds0-2/train.tsv"
    benchmark.parent.mkdir(parents=True)
    benchmark.write_text("s\th:m:s\tmax_rss\n5.50\t0:00:05\t300.1\n")
    assert cost.measured_rates(tmp_path / "results", tmp_path / "none.json").start == pytest.approx(1.5)
    benchmark.write_text("s\th:m:s\tmax_rss\n1.00\t0:00:01\t300.1\n")  # its record counts the job before it too
    assert cost.measured_rates(tmp_path / "results", tmp_path / "none.json").start == cost.Rates().start


def test_without_blocks_the_reference_run_tells_and_without_that_a_guess(tmp_path):
    reference = tmp_path / "manifest.json"
    assert cost.measured_rates(tmp_path, reference) == cost.Rates()
    reference.write_text(json.dumps({"blocks": [{"env_steps": 5000, "wall_seconds": 2.5}]}))
    assert cost.measured_rates(tmp_path, reference).training == pytest.approx(2000)
