"""Lanes of Reacher are Gymnasium's Reacher-v5, bit for bit."""

import gymnasium
import mujoco
import numpy as np
import pytest

from reacher_shaping.tasks.base import Lanes, control_cost, profiling_clock
from reacher_shaping.tasks.reacher import TASK, arm_model, dense, draw_reset, load_model, sparse

LANES = 20
STEPS = TASK.episode_steps


def gymnasium_episodes(actions, generator, control_weight):
    """Step the original: observations [51, L, 10], rewards [50, L], and steps at a joint limit."""
    env = gymnasium.make("Reacher-v5", reward_control_weight=control_weight)
    env.unwrapped.np_random = generator
    observation = np.empty((STEPS + 1, actions.shape[1], 10))
    reward = np.empty(actions.shape[:2])
    limited = 0
    for lane in range(actions.shape[1]):
        observation[0, lane], _ = env.reset()
        for t in range(STEPS):
            observation[t + 1, lane], reward[t, lane], terminated, truncated, _ = env.step(actions[t, lane])
            limited += env.unwrapped.data.nefc > 0
            assert not terminated
            assert truncated == (t == STEPS - 1)
            assert env.unwrapped.data.ncon == 0
    env.close()
    return observation, reward, limited


def lane_episodes(actions, generator, control_weight):
    lanes = Lanes(TASK, actions.shape[1])
    lanes.reset([draw_reset(generator) for _ in range(actions.shape[1])])
    observation, reward = [lanes.observation.copy()], []
    for action in actions:
        lanes.step(action)
        observation.append(lanes.observation.copy())
        cost = control_cost(action)
        reward.append(dense(lanes.measured, cost, control_weight=control_weight, success_radius=0.0))
    return np.array(observation), np.array(reward)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize(
    ("scale", "offset"),
    [(0.1, 0.0), (1.0, 0.0), (100.0, 0.0), (1.0, 3.0), (1e15, 0.0)],
    ids=["small", "unit", "far_out_of_range", "one_way", "huge"],
)
def test_lanes_give_gymnasiums_observations_rewards_and_resets_bit_for_bit(scale, offset, dtype):
    actions = np.random.default_rng(1).normal(offset, scale, (STEPS, LANES, 2)).astype(dtype)
    expected, rewards, limited = gymnasium_episodes(actions, np.random.default_rng(2), 0.1)
    observation, reward = lane_episodes(actions, np.random.default_rng(2), 0.1)
    np.testing.assert_array_equal(observation, expected)
    np.testing.assert_array_equal(reward, rewards)
    if scale >= 1:
        assert limited > 0, "these actions must reach the joint limit"


def test_actions_that_are_not_finite_do_what_they_do_in_gymnasium():
    """MuJoCo applies none of a step's torques where one is not a number, and clamps infinite ones."""
    odd = np.array([np.nan, np.inf, -np.inf, 0.5, -0.3, 2.0, 1e10, -1e11])
    actions = np.random.default_rng(1).choice(odd, (STEPS, LANES, 2))
    expected, rewards, _ = gymnasium_episodes(actions, np.random.default_rng(2), 0.1)
    observation, reward = lane_episodes(actions, np.random.default_rng(2), 0.1)
    np.testing.assert_array_equal(observation, expected)
    np.testing.assert_array_equal(reward, rewards)
    assert np.isfinite(observation).all()


def test_an_action_that_is_not_a_number_stays_in_its_lane():
    draws = [draw_reset(np.random.default_rng(8))] * 3
    lanes, still = Lanes(TASK, 3), Lanes(TASK, 3)
    lanes.reset(draws)
    still.reset(draws)
    lanes.step(np.array([[np.nan, 0.5], [np.inf, 0.5], [0.2, 0.1]]))
    still.step(np.array([[0.0, 0.0], [1.0, 0.5], [0.2, 0.1]]))
    np.testing.assert_array_equal(lanes.observation, still.observation)


def test_thousands_of_resets_are_gymnasiums_draws():
    env = gymnasium.make("Reacher-v5").unwrapped
    env.np_random = np.random.default_rng(3)
    generator = np.random.default_rng(3)
    for _ in range(2000):
        env.reset()
        np.testing.assert_array_equal(draw_reset(generator), [*env.data.qpos, *env.data.qvel])
    assert generator.bit_generator.state == env.np_random.bit_generator.state


def test_lanes_do_not_see_each_other():
    actions = np.random.default_rng(4).normal(0, 1, (STEPS, 5, 2))
    together, _ = lane_episodes(actions, np.random.default_rng(5), 1.0)
    draws = np.random.default_rng(5)
    for lane in range(5):
        alone, _ = lane_episodes(actions[:, lane : lane + 1], draws, 1.0)
        np.testing.assert_array_equal(alone[:, 0], together[:, lane])


def test_a_reset_forgets_the_episode_before():
    """The solver's warm start too, which shows at the joint limit."""
    lanes = Lanes(TASK, 2)
    draws = [draw_reset(np.random.default_rng(seed)) for seed in (6, 7)]

    def episode(torque):
        lanes.reset(draws)
        seen = [lanes.observation.copy()]
        for _ in range(STEPS):
            lanes.step(np.full((2, 2), torque))
            seen.append(lanes.observation.copy())
        return np.array(seen)

    first = episode(0.7)
    assert (np.abs(lanes.data.qpos[:, 1]) > 2.99).all(), "the arm must be at its limit"
    episode(-1.0)
    assert (np.abs(lanes.data.qpos[:, 1]) > 2.99).all(), "the arm must be at its limit"
    np.testing.assert_array_equal(episode(0.7), first)


def test_a_reset_leaves_nothing_of_the_episode_before():
    rng = np.random.default_rng(12)
    used, fresh = Lanes(TASK, 2), Lanes(TASK, 2)
    used.reset([draw_reset(rng) for _ in range(2)])
    for _ in range(STEPS):
        used.step(np.ones((2, 2)))  # to the joint limit, where the solver starts from its last forces
    draws = [draw_reset(rng) for _ in range(2)]
    for lanes in (used, fresh):
        lanes.reset(draws)
    np.testing.assert_array_equal(used.batch.state, fresh.batch.state)


@pytest.mark.parametrize("count", [1, 2, 4])
def test_wrong_numbers_of_resets_and_actions_are_refused(count):
    lanes = Lanes(TASK, 3)
    with pytest.raises(ValueError, match=f"{count} resets for 3 lanes"):
        lanes.reset([draw_reset(np.random.default_rng(0))] * count)
    lanes.reset([draw_reset(np.random.default_rng(0))] * 3)
    with pytest.raises(ValueError, match=rf"shape \({count}, 2\) for 3 lanes"):
        lanes.step(np.zeros((count, 2)))


def test_the_arm_alone_has_the_inertia_limits_and_motors_of_the_whole_model():
    whole, arm = load_model(), arm_model()
    assert (arm.nbody, arm.ngeom, arm.nv) == (4, 0, 2)
    for name in (
        "body_mass", "body_inertia", "body_ipos", "body_iquat", "body_pos", "body_invweight0", "dof_M0", "dof_armature",
        "dof_damping", "dof_invweight0", "jnt_range", "jnt_solref", "jnt_solimp", "actuator_gear", "actuator_ctrlrange",
    ):  # fmt: skip
        ours, given = getattr(arm, name), getattr(whole, name)
        np.testing.assert_array_equal(ours, given[: len(ours)], err_msg=name)
    assert arm.stat.meaninertia * arm.nv == whole.stat.meaninertia * whole.nv


def test_no_pair_of_the_models_geometries_can_collide():
    """Why they may be left out; a model that changes this must bring them back."""
    model = load_model()
    assert not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CONTACT
    assert model.npair == 0
    contype, conaffinity = model.geom_contype, model.geom_conaffinity
    allowed = (contype[:, None] & conaffinity) | (contype & conaffinity[:, None])
    pairs = np.argwhere(np.triu(allowed, 1))
    data = mujoco.MjData(model)
    rng = np.random.default_rng(9)
    for _ in range(500 if len(pairs) else 1):
        data.qpos[:] = rng.uniform(-np.pi, np.pi, 4)
        mujoco.mj_forward(model, data)
        assert data.ncon == 0


def test_the_sparse_reward_is_one_within_the_radius_less_the_control_cost():
    measured = np.array([[0.019], [0.02], [0.021]])
    cost = np.array([0.0, 2.0, 2.0])
    assert sparse(measured, cost, control_weight=0.5, success_radius=0.02).tolist() == [1.0, 0.0, -1.0]


def test_control_cost_keeps_the_precision_of_the_action():
    action = np.array([[0.1, 0.2]], dtype=np.float32)
    cost = control_cost(action)
    assert cost.dtype == np.float32
    assert cost[0] == np.square(action[0]).sum()


def test_lanes_switch_mujocos_profiling_clock_off():
    clock = profiling_clock()
    Lanes(TASK, 1)
    assert clock.value is None
