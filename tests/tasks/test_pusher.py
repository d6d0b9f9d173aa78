"""Lanes of Pusher are Gymnasium's Pusher-v5, bit for bit."""

import gymnasium
import numpy as np
import pytest

from reacher_shaping.tasks.base import Lanes, control_cost
from reacher_shaping.tasks.pusher import TASK, dense, draw_reset, sparse

LANES = 6


def actions_of(kind, dtype):
    rng = np.random.default_rng(1)
    if kind == "downwards":  # the arm comes down on table and puck
        pushing = np.array([0.3, 1.0, 0.0, 0.3, 0.0, 0.0, 0.0])
        return (pushing + rng.normal(0, 0.3, (100, LANES, 7))).astype(dtype)
    if kind == "odd":
        odd = np.array([np.nan, np.inf, -np.inf, 0.5, -0.3, 2.0, 1e10, -1e11])
        return rng.choice(odd, (100, LANES, 7), p=[0.02] + [0.14] * 7).astype(dtype)
    return rng.normal(0, {"small": 0.1, "unit": 1.0, "huge": 1e6}[kind], (100, LANES, 7)).astype(dtype)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("kind", ["small", "unit", "huge", "downwards", "odd"])
def test_lanes_give_gymnasiums_observations_rewards_and_resets_bit_for_bit(kind, dtype):
    env, actions = gymnasium.make("Pusher-v5").unwrapped, actions_of(kind, dtype)
    env.np_random, generator = np.random.default_rng(2), np.random.default_rng(2)
    lanes = Lanes(TASK, LANES)
    lanes.reset([draw_reset(generator) for _ in range(LANES)])
    found, rewards = [lanes.observation.copy()], []
    for action in actions:
        lanes.step(action)
        found.append(lanes.observation.copy())
        rewards.append(dense(lanes.measured, control_cost(action), control_weight=0.1, success_radius=0.0))
    touched = limited = 0
    for lane in range(LANES):
        expected, _ = env.reset()
        np.testing.assert_array_equal(found[0][lane], expected)
        for t in range(100):
            expected, given, *_ = env.step(actions[t, lane])
            np.testing.assert_array_equal(found[t + 1][lane], expected, err_msg=f"step {t}")
            np.testing.assert_array_equal(rewards[t][lane], given)
            touched += env.data.ncon > 0
            limited += env.data.nefc > env.data.ncon
    assert kind != "downwards" or touched > 50
    assert kind not in ("huge", "downwards") or limited > 50


def test_thousands_of_resets_are_gymnasiums_draws():
    env, generator = gymnasium.make("Pusher-v5").unwrapped, np.random.default_rng(3)
    env.np_random = np.random.default_rng(3)
    for _ in range(2000):
        env.reset()
        np.testing.assert_array_equal(draw_reset(generator), [*env.data.qpos, *env.data.qvel])
    assert generator.bit_generator.state == env.np_random.bit_generator.state


def test_a_reset_leaves_nothing_of_the_episode_before():
    rng = np.random.default_rng(4)
    used, fresh = Lanes(TASK, 2), Lanes(TASK, 2)
    used.reset([draw_reset(rng) for _ in range(2)])
    for _ in range(50):
        used.step(rng.normal(size=(2, 7)))
    draws = [draw_reset(rng) for _ in range(2)]
    for lanes in (used, fresh):
        lanes.reset(draws)
    np.testing.assert_array_equal(used.batch.state, fresh.batch.state)
    np.testing.assert_array_equal(used.observation, fresh.observation)


def test_the_sparse_reward_counts_the_puck_alone():
    measured = np.array([[0.05, 9.0], [0.06, 0.0]])
    assert sparse(measured, np.array([0.0, 2.0]), control_weight=0.5, success_radius=0.05).tolist() == [1.0, -1.0]
