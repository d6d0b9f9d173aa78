"""Another task is one file, another schedule one record: a toy of each trains, and nothing else knows of it."""

import sys

import numpy as np
import pandas as pd
import plain_loop
import pytest
import torch
from cells import fresh_policy, small
from toys import point_mass

from reacher_shaping.evaluation.evaluate import Conditions, evaluate
from reacher_shaping.jobs.checkpoint import load_checkpoint, save_checkpoint
from reacher_shaping.settings.cell import PPO, Cell, Environment, Protocol, Shaping, Variant
from reacher_shaping.storage import block_schemas
from reacher_shaping.storage.files import write_table
from reacher_shaping.tasks.base import Lanes
from reacher_shaping.tasks.reacher import TASK
from reacher_shaping.training import schedules
from reacher_shaping.training.alignment import alignment
from reacher_shaping.training.records import Schedule
from reacher_shaping.training.rollout import Collector, RolloutLayout
from reacher_shaping.training.train import _outputs, train

FALLING = Schedule(
    start=lambda seeds: {"success": np.zeros(seeds)},
    weight=lambda variant, state, env_steps: (1 - state["success"]).reshape(-1, *[1] * env_steps.ndim),
    update=lambda variant, state, measured: {"success": 0.5 * state["success"] + 0.5 * measured["success_rate"]},
)
"""A weight that falls with a seed's own success."""


@pytest.fixture(autouse=True)
def toys(monkeypatch):
    monkeypatch.setitem(sys.modules, "reacher_shaping.tasks.point_mass", point_mass)
    monkeypatch.setattr(schedules, "falling", FALLING, raising=False)


def toy_cell(*, task="reacher", schedule="constant", alpha0=1.0, iterations=4, **ppo):
    """A cell; the names of toys are no allowed settings, so its parts are made without asking."""
    environment = Environment.model_construct(task=task, control_weight=0.01, clip_actions=False)
    settings = PPO(**{"rollout_steps": 192, "epochs": 2, "minibatch_size": 32, **ppo})
    protocol = Protocol.model_construct(
        name="toy", environment=environment, ppo=settings, shaping=Shaping(), log=Protocol(name="p").log
    )
    variant = Variant.model_construct(name="l2", potential="l2", schedule=schedule, horizon=None)
    return Cell.model_construct(
        protocol=protocol, variant=variant, budget=iterations * settings.rollout_steps, alpha0=alpha0, root_seed=7
    )


def trained(cell, seeds, state=None, iterations=None, radius=0.1):
    for found in train(cell, seeds, success_radius=radius, state=state):
        if found.iteration == iterations:
            break
    return found


def test_lanes_of_the_toy_are_a_damped_mass_pushed_by_eulers_steps():
    """The damping of 1 N s/m is taken at the end of a step, as MuJoCo's Euler integrator does."""
    generator = np.random.default_rng(0)
    draws = [point_mass.draw_reset(generator) for _ in range(5)]
    place, goal = np.array(draws).T
    speed = np.zeros(5)
    lanes = Lanes(point_mass.TASK, 5)
    lanes.reset(draws)
    for _ in range(30):
        force = generator.normal(size=(5, 1))
        lanes.step(force)
        for _ in range(2):
            speed = (0.2 * speed + 0.05 * force[:, 0].clip(-1, 1)) / (0.2 + 0.05)
            place = place + 0.05 * speed
        np.testing.assert_allclose(lanes.observation, np.column_stack([place, speed, goal]), atol=1e-12)
        np.testing.assert_allclose(lanes.distance, np.abs(place - goal), atol=1e-12)


def test_the_toy_task_is_learned_and_evaluated():
    settings = {"rollout_steps": 480, "epochs": 5, "minibatch_size": 60, "learning_rate": 3e-3, "discount": 0.9}
    cell = toy_cell(task="point_mass", iterations=30, **settings)
    state = trained(cell, [0, 1])
    assert state.episode_returns.shape == (2, 30, 16)
    assert (state.progress["episode_length"] == 30).all()
    first, last = state.episode_returns[:, :4].mean((1, 2)), state.episode_returns[:, -4:].mean((1, 2))
    assert (last > 0.6 * first).all(), "returns are negative"
    conditions = Conditions(
        environment=cell.protocol.environment, root_seed=1, success_radius=0.1, episodes=50, mode="deterministic"
    )
    rows = evaluate(state.policy().act, [0, 1], conditions)
    still = evaluate(lambda observation, noise: np.zeros((*observation.shape[:2], 1)), [0], conditions)
    assert rows["final_distance"].mean() < 0.5 * still["final_distance"].mean()


def test_a_weight_with_a_state_falls_with_each_seeds_own_success_and_is_logged(tmp_path):
    state = trained(toy_cell(schedule="falling", alpha0=3.0), [0, 1], radius=0.15)
    success, alpha = state.progress["success_rate"], state.progress["alpha"]
    average = np.zeros(2)
    for iteration in range(state.iteration):
        np.testing.assert_allclose(alpha[:, iteration], 3 * (1 - average))
        average = 0.5 * average + 0.5 * success[:, iteration]
    assert len(set(alpha[:, -1])) == 2, "the seeds must have fared differently"
    frame = state.progress_frame()
    assert frame.columns[-1] == "alpha"
    write_table(tmp_path / "progress.parquet", frame, block_schemas.PROGRESS)


def test_a_weight_with_a_state_shapes_with_what_it_was_in_the_iteration():
    """Shaped less unshaped return is the weight's multiple of what a constant weight of 1 would add."""
    state = trained(toy_cell(schedule="falling", alpha0=3.0), [0, 1], radius=0.15, iterations=1)
    constant = trained(toy_cell(alpha0=1.0), [0, 1], radius=0.15, iterations=1)
    added, expected = (
        found.progress["shaped_return"][:, 0] - found.progress["episode_return"][:, 0] for found in (state, constant)
    )
    np.testing.assert_allclose(added, 3 * expected, rtol=1e-9)


def test_a_seeds_weight_is_the_same_in_every_block():
    both, alone = (trained(toy_cell(schedule="falling"), seeds, radius=0.15) for seeds in ([0, 1], [1]))
    assert torch.equal(both.parameters[1], alone.parameters[0])
    np.testing.assert_array_equal(both.progress["alpha"][1], alone.progress["alpha"][0])


def test_the_state_of_a_weight_survives_a_checkpoint(tmp_path):
    cell = toy_cell(schedule="falling", iterations=5)
    whole = trained(cell, [0, 1], radius=0.15)
    path = tmp_path / "key" / "checkpoint.pt"
    save_checkpoint(path, trained(cell, [0, 1], radius=0.15, iterations=2))
    kept, _ = load_checkpoint(path)
    resumed = trained(cell, [0, 1], state=kept, radius=0.15)
    assert torch.equal(resumed.parameters, whole.parameters)
    pd.testing.assert_frame_equal(resumed.progress_frame(), whole.progress_frame(), check_exact=True)


def test_the_success_schedule_is_one_less_the_moving_average_of_each_seeds_success():
    cell = small("success", alpha0=50.0, iterations=5)
    state = trained(cell, [0, 1], radius=0.15)
    average = np.zeros(2)
    for success, alpha in zip(state.progress["success_rate"].T, state.progress["alpha"].T, strict=True):
        np.testing.assert_allclose(alpha, 50 * (1 - average), rtol=1e-12)
        average += 0.2 * (success - average)
    assert average.min() > 0


@pytest.mark.parametrize("variant", ["success", "bilevel", "learned"])
def test_what_adapts_survives_a_kill_with_the_same_bits_in_every_block(variant, tmp_path):
    cell = small(variant, alpha0=50.0, iterations=5)
    state = trained(cell, [0, 1], radius=0.15)
    moving = state.shaping["knots"] if variant == "learned" else state.progress["alpha"]
    assert len(np.unique(moving)) > 5, "it must move, each seed's its own way"
    path = tmp_path / "key" / "checkpoint.pt"
    save_checkpoint(path, trained(cell, [0, 1], radius=0.15, iterations=3))
    resumed = trained(cell, [0, 1], state=load_checkpoint(path)[0], radius=0.15)
    assert torch.equal(resumed.parameters, state.parameters)
    pd.testing.assert_frame_equal(resumed.progress_frame(), state.progress_frame(), check_exact=True)
    alone = trained(cell, [1], radius=0.15)
    assert torch.equal(alone.parameters[0], state.parameters[1])
    np.testing.assert_array_equal(alone.progress["alpha"][0], state.progress["alpha"][1])


def test_the_alignment_is_the_cosine_of_the_policy_gradients_that_autograd_gives():
    """One network of torch.nn a seed; rewards to come summed plainly, episode by episode."""
    cell = small("l2", alpha0=3.0)
    policy, layout = fresh_policy([0, 1], 7), RolloutLayout(192, 50)
    rollout = Collector(TASK, [0, 1], 7, layout).collect(policy, 0)
    rng = np.random.default_rng(0)
    reward, shaping = rng.normal(size=(2, 2, 4, 50))
    features, log_prob, _ = _outputs(policy, rollout)
    found = alignment(policy, features, rollout.action, log_prob, reward, shaping, layout, cell.protocol.ppo)
    for seed in range(2):
        network = plain_loop.Network()
        network.load_state_dict({name: tensor[seed] for name, tensor in policy.weights().items()})
        network.double()
        gradients = []
        for terms, decay in ((reward[seed], 0.99), (shaping[seed], 0.99 * 0.95)):
            to_come = np.zeros((4, 50))
            for lane, length in enumerate(layout.lengths):
                for t in range(length):
                    to_come[lane, t] = sum(decay ** (k - t) * terms[lane, k] for k in range(t, length))
            to_come -= to_come[:3].mean(0)
            network.zero_grad()
            for lane, length in enumerate(layout.lengths):
                distribution, _ = network(torch.from_numpy(rollout.observation[seed, lane, :length]))
                chosen = torch.from_numpy(rollout.action[seed, lane, :length]).double()
                (distribution.log_prob(chosen).sum(-1) * torch.from_numpy(to_come[lane, :length])).sum().backward()
            parts = [p.grad.flatten() for p in network.parameters() if p.grad is not None]
            gradients.append(torch.cat(parts))
        expected = torch.nn.functional.cosine_similarity(*gradients, dim=0).item()
        assert found[seed] == pytest.approx(expected, abs=1e-4)
        assert abs(expected) > 1e-3
    same = alignment(policy, features, rollout.action, log_prob, reward, 0 * shaping, layout, cell.protocol.ppo)
    assert same.tolist() == [0, 0]
