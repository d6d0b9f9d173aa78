"""Advantages are those of Stable-Baselines3 and of hand calculation, and stop at an episode's end."""

import numpy as np
import pytest
import torch
from gymnasium.spaces import Box
from stable_baselines3.common.buffers import RolloutBuffer

from reacher_shaping.training.advantage import gae, next_values, normalise
from reacher_shaping.training.rollout import RolloutLayout

DISCOUNT, LAMBDA = 0.99, 0.95


def sequential_gae(reward, value, last_value, episode_ends, *, bootstrap):
    """Stable-Baselines3's buffer over one sequence of steps [N].

    Its time-limit bootstrapping adds gamma V(s') to the reward of a truncated step; `last_value` [N] is that V(s').
    """
    count = len(reward)
    buffer = RolloutBuffer(
        count, Box(-1, 1, (1,)), Box(-1, 1, (1,)), device="cpu", gae_lambda=LAMBDA, gamma=DISCOUNT, n_envs=1
    )
    starts = np.concatenate([[True], episode_ends[:-1]])
    for n in range(count):
        kept = reward[n] + (DISCOUNT * last_value[n] if episode_ends[n] and bootstrap else 0.0)
        buffer.add(
            np.zeros((1, 1)), np.zeros((1, 1)), np.array([kept]), np.array([starts[n]]),
            torch.tensor([value[n]]), torch.tensor([0.0]),
        )  # fmt: skip
    buffer.compute_returns_and_advantage(torch.tensor([0.0]), np.array([True]))
    return buffer.advantages[:, 0], buffer.returns[:, 0]


@pytest.mark.parametrize("episode_end", ["terminal", "bootstrap"])
@pytest.mark.parametrize("steps", [2048, 100, 148, 7])
def test_advantages_and_returns_are_those_of_stable_baselines3(episode_end, steps):
    layout = RolloutLayout(steps, 50)
    rng = np.random.default_rng(0)
    reward = rng.normal(-0.2, 1, (2, layout.lanes, 50))
    values = rng.normal(size=(2, layout.lanes, 51))
    following = next_values(values, layout.episode_ends, episode_end)
    ours = gae(reward, values[..., :-1], following, layout.episode_ends, discount=DISCOUNT, gae_lambda=LAMBDA)
    for seed in range(2):
        sequence = [layout.sequence(array)[seed] for array in (reward, values[..., :-1], values[..., 1:])]
        episode_ends = layout.sequence(np.broadcast_to(layout.episode_ends, (2, *layout.episode_ends.shape)))[seed]
        advantages, returns = sequential_gae(*sequence, episode_ends, bootstrap=episode_end == "bootstrap")
        # The buffer keeps float32.
        np.testing.assert_allclose(layout.sequence(ours)[seed], advantages, rtol=2e-5, atol=2e-5)
        np.testing.assert_allclose(layout.sequence(ours)[seed] + sequence[1], returns, rtol=2e-5, atol=2e-5)


def one_lane(reward, values, episode_ends, *, discount=0.5, gae_lambda=0.5, episode_end="terminal"):
    values = np.array(values, dtype=float)[None, None]
    episode_ends = np.array(episode_ends)[None]
    following = next_values(values, episode_ends, episode_end)
    reward = np.array(reward, dtype=float)[None, None]
    return gae(reward, values[..., :-1], following, episode_ends, discount=discount, gae_lambda=gae_lambda)[0, 0]


def test_three_steps_worked_by_hand():
    # delta = 1 + .5*2 - 4, 2 + .5*8 - 2, 3 + .5*0 - 8; A = delta + .25 A'
    result = one_lane([1, 2, 3], [4, 2, 8, 16], [False, False, True])
    assert result.tolist() == [-2 + 0.25 * (4 + 0.25 * -5), 4 + 0.25 * -5, -5]
    # with bootstrapping the last delta is 3 + .5*16 - 8
    result = one_lane([1, 2, 3], [4, 2, 8, 16], [False, False, True], episode_end="bootstrap")
    assert result.tolist() == [-2 + 0.25 * (4 + 0.25 * 3), 4 + 0.25 * 3, 3]


def test_lambda_zero_is_the_one_step_error_and_lambda_one_the_discounted_return():
    reward, values, episode_ends = [1, 2, 3], [4, 2, 8, 16], [False, False, True]
    assert one_lane(reward, values, episode_ends, gae_lambda=0).tolist() == [-2, 4, -5]
    assert one_lane(reward, values, episode_ends, gae_lambda=1).tolist() == [1 + 1 + 0.75 - 4, 2 + 1.5 - 2, 3 - 8]


@pytest.mark.parametrize("episode_end", ["terminal", "bootstrap"])
def test_nothing_after_a_lanes_end_reaches_back(episode_end):
    """The lane of 48 steps: whatever stands in its two unused steps, even NaN, changes nothing before."""
    layout = RolloutLayout(2048, 50)
    assert layout.lengths.tolist() == [50] * 40 + [48]
    rng = np.random.default_rng(1)
    reward, values = rng.normal(size=(1, 41, 50)), rng.normal(size=(1, 41, 51))

    def advantages():
        following = next_values(values, layout.episode_ends, episode_end)
        result = gae(reward, values[..., :-1], following, layout.episode_ends, discount=DISCOUNT, gae_lambda=LAMBDA)
        return layout.sequence(result)

    before = advantages()
    reward[:, -1, 48:] = np.nan
    values[:, -1, 49:] = np.nan
    np.testing.assert_array_equal(advantages(), before)
    assert np.isfinite(before).all()


def test_truncation_bootstraps_the_value_and_a_terminal_end_does_not():
    """A constant reward of 1 for ever is worth 1 / (1 - gamma); the true value leaves no advantage."""
    worth = 1 / (1 - DISCOUNT)
    kwargs = {"discount": DISCOUNT, "gae_lambda": LAMBDA}
    episode_ends = [False] * 9 + [True]
    bootstrapped = one_lane([1] * 10, [worth] * 11, episode_ends, episode_end="bootstrap", **kwargs)
    np.testing.assert_allclose(bootstrapped, 0, atol=1e-10)
    terminal = one_lane([1] * 10, [worth] * 11, episode_ends, **kwargs)
    np.testing.assert_allclose(terminal, -DISCOUNT * worth * (DISCOUNT * LAMBDA) ** np.arange(9, -1, -1))


def test_normalisation_is_per_seed_over_the_whole_rollout_with_unbiased_deviation():
    rng = np.random.default_rng(2)
    advantages = rng.normal(3, [[1], [100]], (2, 2048))
    ours = normalise(advantages)
    for seed in range(2):
        values = torch.from_numpy(advantages[seed])
        expected = (values - values.mean()) / (values.std() + 1e-8)
        np.testing.assert_allclose(ours[seed], expected.numpy(), rtol=1e-12, atol=1e-12)
    advantages[1] = np.nan
    np.testing.assert_array_equal(normalise(advantages)[0], ours[0])
