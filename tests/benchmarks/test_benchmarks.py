"""The benchmark runs, and what it compares with computes the same."""

import re
import subprocess
import sys
from pathlib import Path

import mujoco.rollout
import numpy as np
import pandas as pd
import pytest
import torch
from cells import small
from mujoco.batch import Batch

from reacher_shaping.jobs.cost import Rates
from reacher_shaping.settings.study import load_study, read_settings
from reacher_shaping.tasks.base import Lanes
from reacher_shaping.tasks.reacher import TASK

pytestmark = pytest.mark.slow

CLOCK_OFF = "+ profiling clock off"
BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture(autouse=True)
def path(monkeypatch):
    monkeypatch.syspath_prepend(str(BENCHMARKS))


def test_every_rung_of_the_ladder_trains_the_same_weights():
    import ladder

    of = small("l2", iterations=3)
    trained = {name: [next(iterator) for _ in range(2)][-1] for name, (_, iterator) in ladder.rungs(of, [4, 1]).items()}
    network, _ = trained.pop("plain loop")
    expected = network.state_dict()
    assert list(trained) == ["+ lanes", "+ stack of seeds", "+ written-out gradient", "+ lean model", CLOCK_OFF]
    for name, state in trained.items():
        weights = state.policy().weights()
        for key, tensor in expected.items():
            # Float32 sums in another order; training moves the weights a thousand times as far.
            torch.testing.assert_close(weights[key][0], tensor, rtol=0, atol=2e-5, msg=f"{name}: {key}")
    before = trained["+ written-out gradient"]
    for name, idea in (("+ lean model", "what moves nothing"), (CLOCK_OFF, "the profiling clock")):
        assert torch.equal(trained[name].parameters, before.parameters), f"{idea} changes no bit"


def test_the_floor_holds_every_matrix_product_of_an_iteration(monkeypatch):
    import floor
    import ladder

    of = small("l2", iterations=2)
    iterator = ladder.engine(of, [0, 1, 2])
    next(iterator)
    matmul, counted = np.matmul, []

    def work(a, b):
        return matmul(a, b).size * a.shape[-1]

    def counting(a, b, **out):
        counted.append(work(a, b))
        return matmul(a, b, **out)

    monkeypatch.setattr(np, "matmul", counting)
    next(iterator)
    products = floor.matrix_products(of.protocol.ppo, 3)
    assert sum(counted) == sum(times * work(a, b) for times, operands in products for a, b in operands)


def test_the_floor_steps_as_the_engine_does_in_its_next_iteration(monkeypatch):
    import floor
    import ladder

    of = small("l2", iterations=2)
    iterator = ladder.engine(of, [0, 1, 2])
    floor_of_three, state = floor.Floor(of, 3), next(iterator)
    step, stepped, rollout, made = Batch.step, [], mujoco.rollout.rollout, []

    def recording(batch, **count):
        stepped.append(batch.state[:, 1:5].copy())  # positions and velocities
        step(batch, **count)

    monkeypatch.setattr(mujoco.rollout, "rollout", lambda *given: made.append(rollout(*given)[0]))
    floor_of_three.physics(state)
    monkeypatch.setattr(Batch, "step", recording)
    next(iterator)
    after_each_step = made[0][:, 1::2, 1:5].swapaxes(0, 1)
    assert np.array_equal(after_each_step[:-1], stepped[1:])


def test_the_arm_of_the_compiled_peer_is_gymnasiums():
    jax = pytest.importorskip("jax", reason="the compiled peer is an extra: pip install -e .[bench]")
    import jax_ppo

    rng, lanes = np.random.default_rng(0), Lanes(TASK, 40)
    draws = np.array([TASK.draw_reset(rng) for _ in range(lanes.count)])
    lanes.reset(draws)
    angle, velocity, step = draws[:, :2], draws[:, 4:6], jax.jit(jax.vmap(jax_ppo.arm_step))
    for _ in range(TASK.episode_steps):
        torque = rng.normal(0, 1.5, (lanes.count, 2))
        lanes.step(torque)
        angle, velocity, tip = step(angle, velocity, torque)
        np.testing.assert_allclose(tip - draws[:, 2:4], lanes.observation[:, 8:10], rtol=0, atol=1e-6)
    assert (np.abs(np.asarray(angle)[:, 1]) > jax_ppo.LIMIT).any(), "the elbow must reach its limit somewhere"


def test_the_fraction_of_the_floor():
    import floor

    assert floor.fraction(10, 30, 60) == pytest.approx(0.5)  # 1/30 + 1/60 of a second a step, of 1/10


def test_what_prepares_a_share_of_the_floor_does_not_count(monkeypatch):
    import floor

    of = floor.Floor(small("l2", iterations=1), 3)
    ticks = iter([2.0, 6.0])
    monkeypatch.setattr(floor.time, "process_time", lambda: next(ticks))
    steps = of.alone(lambda: 1.0)()  # a second of the four is the share
    assert steps / 4.0 == 3 * of.layout.steps / 1.0


def test_readme_says_what_was_measured():
    import present

    page = (BENCHMARKS.parent / "README.md").read_text()
    sentence = present.readme_sentence(pd.read_csv(BENCHMARKS / "results.csv"))
    assert sentence in page
    assert present.put_sentence(page, "Fast.") == page.replace(sentence, "Fast.")


def test_steps_a_second_are_called_a_speed_and_no_cost():
    import present

    table = pd.read_csv(BENCHMARKS / "results.csv")
    drawn = (BENCHMARKS / "results.svg").read_text(encoding="utf-8")
    for part in ("training", "ladder", "seeds per block", "budget"):
        title, units = present.TITLES[part], table.loc[table["part"] == part, "unit"]
        assert title in drawn
        assert not (units.str.contains("steps/s").any() and re.search("cost|time", title, re.IGNORECASE)), title


def test_quick_benchmark_writes_its_table_and_plot(tmp_path):
    command = [sys.executable, str(BENCHMARKS / "run.py"), "--quick", "--out", str(tmp_path)]
    subprocess.run(command, check=True, capture_output=True)
    table = pd.read_csv(tmp_path / "results.csv")
    parts = {
        "training",
        "first call",
        "return",
        "floor",
        "evaluation",
        "jobs",
        "ladder",
        "ladder gain",
        "seeds per block",
        "budget",
        "workflow",
    }
    assert set(table["part"]) == parts
    assert (table["value"][table["part"] != "return"] > 0).all()
    assert ((table["low"] <= table["value"]) & (table["value"] <= table["high"])).all()
    assert table[["machine", "threads", "versions", "repeats"]].notna().all(axis=None)
    assert table["must"].notna().sum() == 11
    text = (tmp_path / "results.md").read_text()
    assert all(name in text for name in table["name"])
    assert "<svg" in (tmp_path / "results.svg").read_text()


def test_a_checkout_is_measured_against_another(tmp_path):
    given = ["--quick", "--against", str(BENCHMARKS.parent), "--out", str(tmp_path)]
    subprocess.run([sys.executable, str(BENCHMARKS / "run.py"), *given], check=True, capture_output=True)
    table = pd.read_csv(tmp_path / "results.csv")
    assert list(table["part"]) == ["against"] * 2
    assert (table["value"] > 0).all()


def test_cost_of_a_study_is_the_sum_over_its_blocks():
    import cost

    from reacher_shaping.settings.study import load_study

    study = load_study(Path(__file__).parents[2] / "config.yaml")
    rates = cost.Rates(training=20_000, evaluation=50_000, start=3)
    found = cost.study(study, seeds=12, seeds_per_block=10, rates=rates)
    # 14 cells of 500,000 steps (245 iterations) and 9 of 1,000,000 (489), each a block of ten and a block of two
    steps = (14 * 245 + 9 * 489) * 2048
    assert found.env_steps == 12 * steps
    episodes = 23 * 12 * 2 * 1000 * 50
    assert found.core_seconds == pytest.approx(12 * steps / 20_000 + episodes / 50_000 + 23 * 2 * 2 * 3)
    assert found.longest_job == pytest.approx(6 + 10 * (489 * 2048 / 20_000 + 100_000 / 50_000))


def test_blocks_of_the_schedule_take_their_training_and_their_evaluation():
    """Three runs in blocks of two and one; 500,000 steps are 245 rollouts of 2,048."""
    from schedule import blocks

    study = load_study(read_settings("config.yaml"))
    found = blocks(study, 3, 2, Rates(training=20_000, evaluation=50_000, start=3.0))
    assert len(found) == 2 * len(study.cells)
    assert found[:2] == pytest.approx([6 + runs * (245 * 2048 / 20_000 + 100_000 / 50_000) for runs in (2, 1)])


def test_jobs_start_in_order_on_the_core_that_is_free_first():
    """3, 3 and 2 s on two cores: the third starts at 3 s, so 5 s, and 8 of 10 core seconds are used."""
    from schedule import Schedule, simulate

    assert simulate([3, 3, 2], cores=2) == Schedule(5, 0.8)
    assert simulate([3, 3, 2], cores=1).wall == 8
    assert simulate([3, 3, 2], cores=64).wall == 3
    assert simulate([1, 1, 1], cores=64, seconds_per_submission=2.0).wall == 5
