"""A rollout in lanes is the sequential rollout of one Gymnasium environment."""

import numpy as np
import plain_loop
import pytest
from cells import cell, fresh_policy, small

from reacher_shaping.random_streams import Purpose, stream
from reacher_shaping.tasks.reacher import TASK, dense
from reacher_shaping.training.rollout import Collector, RolloutLayout

CELL = cell("l2")
LAYOUT = RolloutLayout(2048, 50)


def policy_of(seeds, of=CELL):
    return fresh_policy(seeds, of.root_seed, of.protocol.ppo)


@pytest.fixture(scope="module")
def rollout():
    """Iteration 5 of seeds 0, 3."""
    return Collector(TASK, [0, 3], CELL.root_seed, LAYOUT).collect(policy_of([0, 3]), 5)


def test_stepping_gymnasium_with_the_same_actions_gives_the_same_bits(rollout):
    """All 2048 steps in their sequential order, the 48-step lane and the state reached at its end included."""
    env = plain_loop.make_environment(CELL)
    rewards = dense(rollout.measured[..., 1:, :], rollout.control, control_weight=0.1, success_radius=0.0)
    for row, seed in enumerate([0, 3]):
        env.unwrapped.np_random = stream(CELL.root_seed, Purpose.RESETS, seed, 5)
        steps = 0
        for lane in range(LAYOUT.lanes):
            observation, _ = env.reset()
            np.testing.assert_array_equal(rollout.observation[row, lane, 0], observation)
            for t in range(LAYOUT.lengths[lane]):
                observation, reward, terminated, truncated, _ = env.step(rollout.action[row, lane, t])
                steps += 1
                np.testing.assert_array_equal(rollout.observation[row, lane, t + 1], observation)
                assert rewards[row, lane, t] == reward
                assert not terminated
                assert truncated == (t == 49)
        assert steps == 2048
    env.close()


def test_rollout_equals_the_plain_loop(rollout):
    """The plain loop samples its own actions, one observation at a time.

    Sums in another order make float32 actions differ in their last digit, and the arm carries that on for 50 steps;
    nothing else differs, so the tolerance is a few hundred such digits.
    """
    network = plain_loop.Network()
    network.load_state_dict({name: tensor[1] for name, tensor in policy_of([0, 3]).weights().items()})
    plain = plain_loop.collect(plain_loop.make_environment(CELL), network, CELL, 3, 5)
    reward = dense(rollout.measured[..., 1:, :], rollout.control, control_weight=0.1, success_radius=0.0)
    sequence = {
        "observation": rollout.observation[:, :, :-1],
        "action": rollout.action,
        "reward": reward,
        "distance": rollout.distance[..., :-1],
        "next_distance": rollout.distance[..., 1:],
        "end": np.broadcast_to(LAYOUT.episode_ends, reward.shape),
    }
    for name, values in sequence.items():
        ours, expected = LAYOUT.sequence(values)[1], getattr(plain, name)
        assert len(ours) == 2048
        np.testing.assert_allclose(ours, expected, rtol=0, atol=0 if name == "end" else 1e-3, err_msg=name)
        if name in ("action", "distance", "reward"):
            assert np.median(np.abs(ours - expected)) < 1e-6
    assert plain.end.sum() == 41


def test_noise_is_indexed_by_episode_and_step(rollout):
    """The action is mean + std noise[episode, step] of the seed's stream of this iteration."""
    noise = stream(CELL.root_seed, Purpose.ACTIONS, 3, 5).standard_normal((41, 50, 2), dtype=np.float32)
    policy = policy_of([3])
    for t in (0, 17, 49):
        expected = policy.act(rollout.observation[1:, :, t], noise[None, :, t])
        np.testing.assert_array_equal(rollout.action[1:, :, t], expected)


@pytest.mark.parametrize("block", [[3], [9, 3, 4], [*range(10)]], ids=len)
def test_a_seeds_rollout_is_the_same_in_every_block(rollout, block):
    ours = Collector(TASK, block, CELL.root_seed, LAYOUT).collect(policy_of(block), 5)
    row = block.index(3)
    for name in ("observation", "distance", "action", "control"):
        np.testing.assert_array_equal(getattr(ours, name)[row], getattr(rollout, name)[1], err_msg=name)


def test_a_collector_keeps_nothing_from_one_rollout_to_the_next(rollout):
    collector = Collector(TASK, [3], CELL.root_seed, LAYOUT)
    for iteration in (0, 5):
        ours = collector.collect(policy_of([3]), iteration)
    np.testing.assert_array_equal(ours.observation, rollout.observation[1:])
    other = collector.collect(policy_of([3]), 6)
    assert not np.array_equal(other.action, rollout.action[1:])


def test_a_shorter_rollout_is_the_start_of_a_longer_one(rollout):
    layout = RolloutLayout(192, 50)
    ours = Collector(TASK, [3], CELL.root_seed, layout).collect(policy_of([3]), 5)
    for name in ("observation", "action"):
        expected = LAYOUT.sequence(getattr(rollout, name)[:, :, :50])[1, :192]
        np.testing.assert_allclose(layout.sequence(getattr(ours, name)[:, :, :50])[0], expected, atol=1e-3)


def test_clipped_actions_are_stepped_and_charged_and_the_loss_sees_the_sample():
    of = small()
    raw, clipped = (
        Collector(TASK, [1], of.root_seed, RolloutLayout(192, 50), clip_actions=clip).collect(policy_of([1], of), 0)
        for clip in (False, True)
    )
    first = raw.action[:, :, 0]
    assert (np.abs(first) > 1).any()
    np.testing.assert_array_equal(clipped.action[:, :, 0], first)
    np.testing.assert_array_equal(raw.control[:, :, 0], np.square(first).sum(-1))
    np.testing.assert_array_equal(clipped.control[:, :, 0], np.square(first.clip(-1, 1)).sum(-1))
    # Reacher's actuators clamp as well: the arm moves the same.
    np.testing.assert_array_equal(clipped.observation, raw.observation)


@pytest.mark.parametrize(("steps", "lengths"), [(2048, [50] * 40 + [48]), (100, [50, 50]), (7, [7]), (51, [50, 1])])
def test_plan_lays_the_steps_out_in_lanes(steps, lengths):
    layout = RolloutLayout(steps, 50)
    assert layout.lengths.tolist() == lengths
    assert layout.lanes == len(lengths)
    assert layout.episodes == lengths.count(50)
    assert layout.sequence(layout.order[None])[0].tolist() == list(range(steps))
    assert np.flatnonzero(layout.sequence(layout.episode_ends[None])[0]).tolist() == [
        sum(lengths[: n + 1]) - 1 for n in range(len(lengths))
    ]
    assert layout.episode_ends.sum() == len(lengths)
