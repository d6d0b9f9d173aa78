"""Lanes of FetchReach are Gymnasium-Robotics' FetchReach-v4, bit for bit."""

import types

import gymnasium
import mujoco
import numpy as np
import pytest
from gymnasium.wrappers import FlattenObservation

from reacher_shaping.tasks.base import Lanes
from reacher_shaping.tasks.fetch_reach import TASK, dense, draw_reset, model_file, sparse

gymnasium_robotics = pytest.importorskip("gymnasium_robotics")
LANES = 6


@pytest.fixture(scope="module")
def make():
    """Makes the environment, in a form that runs beside this version of MuJoCo.

    `mujoco_utils` asks whether a joint's type, a number of NumPy, is among members of an enumeration, which with these
    bindings it never is; so it gets the members' numbers.
    """
    from gymnasium_robotics.utils import mujoco_utils

    numbers = {name: int(member) for name, member in mujoco.mjtJoint.__members__.items()}
    patched = types.SimpleNamespace(**vars(mujoco) | {"mjtJoint": types.SimpleNamespace(**numbers)})
    gymnasium.register_envs(gymnasium_robotics)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mujoco_utils, "mujoco", patched)
        yield lambda reward: FlattenObservation(gymnasium.make("FetchReach-v4", reward_type=reward))


def actions_of(kind, dtype):
    rng = np.random.default_rng(1)
    if kind == "one_way":  # down, to the table
        return np.tile(np.array([0.3, 0.2, -1.0, 0.5]), (50, LANES, 1)).astype(dtype)
    return rng.normal(0, {"small": 0.1, "unit": 1.0, "huge": 1e6}[kind], (50, LANES, 4)).astype(dtype)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("kind", ["small", "unit", "huge", "one_way"])
@pytest.mark.parametrize("reward", ["dense", "sparse"])
def test_lanes_give_the_environments_observations_rewards_and_resets_bit_for_bit(make, kind, dtype, reward):
    if (reward, dtype) == ("sparse", np.float64):
        pytest.skip("the other three tell both rewards and both precisions")
    env, actions = make(reward), actions_of(kind, dtype)
    env.reset(seed=0)
    env.unwrapped.np_random = np.random.default_rng(2)
    generator = np.random.default_rng(2)
    lanes = Lanes(TASK, LANES)
    lanes.reset([draw_reset(generator) for _ in range(LANES)])
    found = [lanes.observation.copy()]
    rewards = []
    for action in actions:
        lanes.step(action)
        found.append(lanes.observation.copy())
        earned = TASK.rewards[reward](lanes.measured, 0.0, control_weight=0.0, success_radius=0.05)
        rewards.append(earned)
    touched = 0
    for lane in range(LANES):
        expected, _ = env.reset()
        np.testing.assert_array_equal(found[0][lane], expected)
        for t in range(50):
            expected, given, terminated, truncated, info = env.step(actions[t, lane])
            np.testing.assert_array_equal(found[t + 1][lane], expected, err_msg=f"step {t}")
            assert rewards[t][lane] == given
            assert not terminated
            assert truncated == (t == 49)
            assert info["is_success"] == (lanes.distance[lane] < 0.05) or t < 49
            touched += env.unwrapped.data.ncon > 0
    if kind == "one_way":
        assert touched > 0, "the gripper must reach the table"


def test_resets_are_the_environments_draws(make):
    env, generator = make("sparse"), np.random.default_rng(3)
    env.reset(seed=0)
    env.unwrapped.np_random = np.random.default_rng(3)
    for _ in range(300):
        env.reset()
        np.testing.assert_array_equal(draw_reset(generator), env.unwrapped.goal)
    assert generator.bit_generator.state == env.unwrapped.np_random.bit_generator.state


def test_a_reset_leaves_nothing_of_the_episode_before():
    rng = np.random.default_rng(4)
    used, fresh = Lanes(TASK, 2), Lanes(TASK, 2)
    used.reset([draw_reset(rng) for _ in range(2)])
    for _ in range(20):
        used.step(rng.normal(size=(2, 4)))
    draws = [draw_reset(rng) for _ in range(2)]
    for lanes in (used, fresh):
        lanes.reset(draws)
    np.testing.assert_array_equal(used.batch.state, fresh.batch.state)
    np.testing.assert_array_equal(used.observation, fresh.observation)


def test_rewards_by_hand():
    measured = np.array([[0.04], [0.05], [0.06]])
    settings = {"control_weight": 0.0, "success_radius": 0.05}
    assert sparse(measured, 0.0, **settings).tolist() == [0, 0, -1]
    assert dense(measured, 0.0, **settings).tolist() == [-0.04, -0.05, -0.06]


def test_without_gymnasium_robotics_the_model_is_missed_by_name(monkeypatch):
    monkeypatch.setattr("reacher_shaping.tasks.fetch_reach.find_spec", lambda name: None)
    with pytest.raises(FileNotFoundError, match="gymnasium-robotics is not installed"):
        model_file()
