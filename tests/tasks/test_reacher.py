"""Lanes are Gymnasium's Reacher-v5, bit for bit."""

import gymnasium
import mujoco
import numpy as np
import pytest

from reacher_shaping.tasks.reacher import (
    EPISODE_STEPS,
    Fields,
    Lanes,
    control_cost,
    draw_reset,
    load_model,
    profiling_clock,
)

LANES = 20


def gymnasium_episodes(actions, generator, control_weight):
    """Step the original: observations [51, L, 10], rewards [50, L], and steps at a joint limit."""
    env = gymnasium.make("Reacher-v5", reward_control_weight=control_weight)
    env.unwrapped.np_random = generator
    observation = np.empty((EPISODE_STEPS + 1, actions.shape[1], 10))
    reward = np.empty(actions.shape[:2])
    limited = 0
    for lane in range(actions.shape[1]):
        observation[0, lane], _ = env.reset()
        for t in range(EPISODE_STEPS):
            observation[t + 1, lane], reward[t, lane], terminated, truncated, _ = env.step(actions[t, lane])
            limited += env.unwrapped.data.nefc > 0
            assert not terminated
            assert truncated == (t == EPISODE_STEPS - 1)
            assert env.unwrapped.data.ncon == 0
    env.close()
    return observation, reward, limited


def lane_episodes(actions, generator, control_weight, contacts):
    lanes = Lanes(actions.shape[1], contacts=contacts)
    lanes.reset([draw_reset(generator) for _ in range(actions.shape[1])])
    observation, reward = [lanes.observation.copy()], []
    for action in actions:
        lanes.step(action)
        observation.append(lanes.observation.copy())
        reward.append(-lanes.distance - control_weight * control_cost(action))
    return np.array(observation), np.array(reward)


@pytest.mark.parametrize("contacts", [False, True], ids=["no_contacts", "contacts"])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize(
    ("scale", "offset"),
    [(0.1, 0.0), (1.0, 0.0), (100.0, 0.0), (1.0, 3.0), (1e15, 0.0)],
    ids=["small", "unit", "far_out_of_range", "one_way", "huge"],
)
def test_lanes_give_gymnasiums_observations_rewards_and_resets_bit_for_bit(scale, offset, dtype, contacts):
    actions = np.random.default_rng(1).normal(offset, scale, (EPISODE_STEPS, LANES, 2)).astype(dtype)
    expected, rewards, limited = gymnasium_episodes(actions, np.random.default_rng(2), 0.1)
    observation, reward = lane_episodes(actions, np.random.default_rng(2), 0.1, contacts)
    np.testing.assert_array_equal(observation, expected)
    np.testing.assert_array_equal(reward, rewards)
    if scale >= 1:
        assert limited > 0, "these actions must reach the joint limit"


def test_thousands_of_resets_are_gymnasiums_draws():
    env = gymnasium.make("Reacher-v5").unwrapped
    env.np_random = np.random.default_rng(3)
    generator = np.random.default_rng(3)
    for _ in range(2000):
        env.reset()
        position, velocity = draw_reset(generator)
        np.testing.assert_array_equal(position, env.data.qpos)
        np.testing.assert_array_equal(velocity, env.data.qvel)
    assert generator.bit_generator.state == env.np_random.bit_generator.state


def test_lanes_do_not_see_each_other():
    actions = np.random.default_rng(4).normal(0, 1, (EPISODE_STEPS, 5, 2))
    together, _ = lane_episodes(actions, np.random.default_rng(5), 1.0, False)
    draws = np.random.default_rng(5)
    for lane in range(5):
        alone, _ = lane_episodes(actions[:, lane : lane + 1], draws, 1.0, False)
        np.testing.assert_array_equal(alone[:, 0], together[:, lane])


def test_a_reset_forgets_the_episode_before():
    """The solver's warm start too, which shows at the joint limit."""
    lanes = Lanes(2)
    draws = [draw_reset(np.random.default_rng(seed)) for seed in (6, 7)]

    def episode(torque):
        lanes.reset(draws)
        seen = [lanes.observation.copy()]
        for _ in range(EPISODE_STEPS):
            lanes.step(np.full((2, 2), torque))
            seen.append(lanes.observation.copy())
        return np.array(seen)

    first = episode(0.7)
    assert lanes.data[0].nefc > 0, "the arm must be at its limit"
    episode(-1.0)
    assert lanes.data[0].nefc > 0, "the arm must be at its limit"
    np.testing.assert_array_equal(episode(0.7), first)


def test_a_torque_that_is_not_finite_counts_as_zero_and_stays_in_its_lane():
    draws = [draw_reset(np.random.default_rng(8))] * 3
    lanes, still = Lanes(3), Lanes(3)
    lanes.reset(draws)
    still.reset(draws)
    lanes.step(np.array([[np.nan, 0.3], [np.inf, -np.inf], [0.2, 0.1]]))
    still.step(np.array([[0.0, 0.3], [0.0, 0.0], [0.2, 0.1]]))
    np.testing.assert_array_equal(lanes.observation, still.observation)


@pytest.mark.parametrize("count", [1, 2, 4])
def test_wrong_numbers_of_resets_and_actions_are_refused(count):
    lanes = Lanes(3)
    with pytest.raises(ValueError, match=rf"\({count}, 14\) for fields of shape \(3, 14\)"):
        lanes.reset([draw_reset(np.random.default_rng(0))] * count)
    lanes.reset([draw_reset(np.random.default_rng(0))] * 3)
    with pytest.raises(ValueError, match=rf"\({count}, 2\) for fields of shape \(3, 2\)"):
        lanes.step(np.zeros((count, 2)))


def test_fields_are_those_of_each_simulation():
    model = load_model()
    simulations = [mujoco.MjData(model) for _ in range(5)]
    for number, data in enumerate(simulations):
        data.qpos[:] = 10 * number + np.arange(4)
        data.ctrl[:] = -number
    fields = Fields([[data.qpos[1:3], data.ctrl] for data in simulations])
    expected = np.array([[10 * number + 1, 10 * number + 2, -number, -number] for number in range(5)])
    np.testing.assert_array_equal(fields.read(), expected)
    fields.write(expected + 0.5)
    for number, data in enumerate(simulations):
        np.testing.assert_array_equal(data.qpos, 10 * number + np.array([0, 1.5, 2.5, 3]))
        np.testing.assert_array_equal(data.ctrl, 0.5 - number)


@pytest.mark.parametrize("view", [np.zeros((2, 2)), np.zeros(4)[::2], np.zeros(3, dtype=np.float32)])
def test_fields_refuse_what_they_cannot_address(view):
    with pytest.raises(ValueError, match="no whole vector of float64"):
        Fields([[np.zeros(2), view]])


def test_fields_refuse_views_out_of_step():
    memory = np.zeros(40, dtype=np.uint8)
    with pytest.raises(ValueError, match="not aligned"):
        Fields([[memory[:16].view(np.float64)], [memory[20:36].view(np.float64)]])


def test_a_reset_leaves_nothing_of_the_episode_before():
    rng = np.random.default_rng(12)
    used, fresh = Lanes(2), Lanes(2)
    used.reset([draw_reset(rng) for _ in range(2)])
    for _ in range(EPISODE_STEPS):
        used.step(np.ones((2, 2)))  # to the joint limit, where the solver starts from its last forces
    draws = [draw_reset(rng) for _ in range(2)]
    for lanes in (used, fresh):
        lanes.reset(draws)
    state = int(mujoco.mjtState.mjSTATE_INTEGRATION) & ~int(mujoco.mjtState.mjSTATE_TIME)
    size = mujoco.mj_stateSize(used.model, state)
    for one, other in zip(used.data, fresh.data, strict=True):
        states = np.empty((2, size))
        mujoco.mj_getState(used.model, one, states[0], state)
        mujoco.mj_getState(used.model, other, states[1], state)
        np.testing.assert_array_equal(states[0], states[1])


def test_no_pair_of_the_models_geometries_can_collide():
    """Why collision detection may be left out; a model that changes this must bring contacts back."""
    model = load_model(contacts=True)
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


def test_control_cost_keeps_the_precision_of_the_action():
    action = np.array([[0.1, 0.2]], dtype=np.float32)
    cost = control_cost(action)
    assert cost.dtype == np.float32
    assert cost[0] == np.square(action[0]).sum()


def test_lanes_switch_mujocos_profiling_clock_off():
    clock = profiling_clock()
    lanes = Lanes(1)
    assert clock.value is None
    lanes.reset([draw_reset(np.random.default_rng(0))])
    lanes.step(np.zeros((1, 2)))
    step = lanes.data[0].timer[mujoco.mjtTimer.mjTIMER_STEP]
    assert (step.number, step.duration) == (2, 0), "both solver steps counted, neither timed"
