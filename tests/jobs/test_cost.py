import json

import pytest

from reacher_shaping.evaluation import episode_lengths
from reacher_shaping.jobs import cost
from reacher_shaping.settings.cell import PPO, Cell, Environment, Protocol, Variant
from reacher_shaping.settings.study import Evaluation
from reacher_shaping.tasks.base import load_task

RATES = cost.Rates(training=1000.0, evaluation=500.0, start=2.0)


def protocol(task="reacher", **ppo):
    return Protocol(name="test", ppo=PPO(**ppo), environment=Environment(task=task))


def cell(task="reacher"):
    return Cell(protocol=protocol(task), variant=Variant(name="l2", potential="l2"), budget=4000)


def test_training_takes_its_whole_rollouts_at_the_rate():
    """4,000 steps are two rollouts of 2,048; three seeds of them at 1,000 steps/s, and the start."""
    assert cost.training_seconds(cell(), 3, RATES) == pytest.approx(2 + 3 * 2 * 2048 / 1000)


def test_more_epochs_and_networks_are_more_work():
    assert cost.work(protocol()) == pytest.approx(1)
    assert cost.work(protocol(epochs=20)) == pytest.approx(0.16 + 2 * 0.84)
    assert cost.work(protocol(networks="separate")) > cost.work(protocol())


def test_evaluation_counts_both_modes():
    seconds = cost.job_seconds("evaluate_block", cell(), Evaluation(episodes=10), 3, RATES)
    assert seconds == pytest.approx(2 + 3 * 2 * 10 * 50 / 500)


def test_long_episodes_and_other_tasks_are_counted_as_they_are():
    """50 episodes each of 50, 100, 200 and 500 steps; Pusher's 100 steps, of a simulation three times as slow."""
    evaluation = Evaluation(episodes=10)
    assert cost.LONG_STEPS == episode_lengths.EPISODES * sum(episode_lengths.LENGTHS) == 50 * 850
    seconds = cost.job_seconds("evaluate_long", cell(), evaluation, 3, RATES)
    assert seconds == pytest.approx(2 + 3 * 42_500 / 500)
    seconds = cost.job_seconds("evaluate_block", cell("pusher"), evaluation, 3, RATES)
    assert seconds == pytest.approx(2 + 3 * 2 * 10 * 100 * (0.55 + 0.45 * 3) / 500)
    assert cost.work(protocol("fetch_reach")) == pytest.approx(0.16 * 36 + 0.84)
    assert {name: load_task(name).episode_steps for name in cost.SIMULATION} == cost.EPISODE_STEPS


@pytest.mark.parametrize("task", ["reacher", "fetch_reach"])
def test_rates_of_a_block_foretell_its_own_seconds(tmp_path, task):
    of = cell(task)
    record = {"settings": {"cell": of.settings()}, "env_steps": 3 * 4096, "wall_seconds": 40.0}
    record["evaluation"] = {"env_steps": 3 * cost.evaluation_steps(of, Evaluation(episodes=10)), "wall_seconds": 15.0}
    folder = tmp_path / "results/test/l2/4000/alpha1/seeds0-2"
    folder.mkdir(parents=True)
    (folder / "manifest.json").write_text(json.dumps(record))
    rates = cost.measured_rates(tmp_path / "results", tmp_path / "none.json")
    for rule, seconds in (("train_block", 40.0), ("evaluate_block", 15.0)):
        assert cost.job_seconds(rule, of, Evaluation(episodes=10), 3, rates) == pytest.approx(rates.start + seconds)


def test_a_job_without_a_cell_and_one_that_runs_nothing_are_small():
    for rule, of in (("judge_claims", None), ("render_media", cell())):
        assert cost.job_seconds(rule, of, Evaluation(), 2, RATES) == cost.SMALL_JOB_SECONDS


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
