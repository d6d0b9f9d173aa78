"""Generalised advantage estimation over lanes (Schulman et al. 2016, eq. 16). Pure functions."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def next_values(values: Array, episode_ends: NDArray[np.bool_], episode_end: str) -> Array:
    """Return the value of the state after each step, [S, L, T], from values [S, L, T+1].

    The one place that says what happens at a lane's last step (`episode_ends` [L, T]). Reacher-v5 never
    terminates: an episode is truncated, or cut by the end of the rollout. "bootstrap" keeps the value
    of the state reached (Pardo et al. 2018); "terminal" takes it as 0, as the released code does.
    """
    following = values[..., 1:]
    return following if episode_end == "bootstrap" else np.where(episode_ends, 0.0, following)


def gae(
    rewards: Array,
    values: Array,
    following: Array,
    episode_ends: NDArray[np.bool_],
    *,
    discount: float,
    gae_lambda: float,
) -> Array:
    """Return advantages A [S, L, T]: A_t = delta_t + gamma lambda A_{t+1} within a lane.

    Args:
        rewards: [S, L, T].
        values: [S, L, T], V(s_t).
        following: [S, L, T], value of the state after each step (see `next_values`).
        episode_ends: [L, T] true at a lane's last step; nothing after it reaches back.
        discount: gamma.
        gae_lambda: lambda.
    """
    deltas = rewards + discount * following - values
    advantages = np.empty_like(deltas)
    carry = np.zeros(deltas.shape[:-1])
    for t in reversed(range(deltas.shape[-1])):
        carry = deltas[..., t] + np.where(episode_ends[:, t], 0.0, discount * gae_lambda * carry)
        advantages[..., t] = carry
    return advantages


def normalise(advantages: Array) -> Array:
    """Return advantages [S, N] shifted and scaled to mean 0 and unbiased deviation 1, per seed."""
    mean = advantages.mean(axis=-1, keepdims=True)
    deviation = advantages.std(axis=-1, ddof=1, keepdims=True)
    normalised: Array = (advantages - mean) / (deviation + 1e-8)
    return normalised
