"""Potential-based reward shaping: potentials, schedules, shaped rewards. Pure functions on arrays.

r'(s, a, s', t) = r + alpha(t) (gamma Phi(s') - Phi(s))    (paper, section 3.4)
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from reacher_shaping.settings.cell import Shaping, Variant

Array = NDArray[np.float64]


def potential(name: str, distance: ArrayLike) -> Array:
    """Return Phi(s) for tip-target distances (any shape, m): 0, -d (L2) or -d^2 (L2-squared).

    Source: paper, section 3.3. Raises ValueError for another name.
    """
    d: Array = np.asarray(distance, dtype=np.float64)
    if name == "none":
        return np.zeros_like(d)
    if name == "l2":
        return np.negative(d)
    if name == "l2sq":
        return np.negative(np.square(d))
    raise ValueError(f"potential = {name!r}; allowed: 'none', 'l2', 'l2sq'")


def alpha(variant: Variant, alpha0: float, env_steps: ArrayLike) -> Array:
    """Return the shaping weight after `env_steps` environment steps of training (any shape).

    Constant alpha0, or alpha0 max(0, 1 - t / T) with the variant's horizon T (paper, section 3.4).
    """
    env_steps = np.asarray(env_steps, dtype=np.float64)
    if variant.horizon is None:
        return np.full_like(env_steps, alpha0)
    return alpha0 * np.maximum(0.0, 1.0 - env_steps / variant.horizon)


def shaping_reward(
    distance: Array,
    env_steps: NDArray[np.int64],
    ends: NDArray[np.bool_],
    *,
    variant: Variant,
    alpha0: float,
    discount: float,
    settings: Shaping,
) -> Array:
    """Return the shaping term F [S, L, T] of every step of a rollout.

    Args:
        distance: [S, L, T+1] m, tip to target in s_0 .. s_T.
        env_steps: [L, T] environment steps of training done before each step: t of alpha(t).
        ends: [L, T] true at a lane's last step, where the episode (or the rollout) is cut.
        variant: potential and schedule.
        alpha0: alpha at t = 0.
        discount: gamma.
        settings: `form` "paper" is alpha(t) (gamma Phi' - Phi); "dynamic" is gamma alpha(t+1) Phi' -
            alpha(t) Phi, which leaves the optimal policy unchanged for any alpha(t) (Devlin & Kudenko
            2012, eq. 3). `terminal_potential` "zero" takes Phi = 0 in the state after a last step,
            which invariance needs if that state's value counts as zero (Grzes 2017); the paper keeps
            it. With "bootstrap" ends the next state's value counts, so its potential is always kept.
            `decay_potential` "l2sq" gives every decayed variant that potential, and `alpha0` "label" starts
            every weight at 1, as the code released with the paper does.
    """
    decays = variant.horizon is not None
    phi = potential(
        settings.decay_potential if decays and settings.decay_potential != "variant" else variant.potential, distance
    )
    alpha0 = 1.0 if settings.alpha0 == "label" else alpha0
    before, after = phi[..., :-1], phi[..., 1:]
    if settings.terminal_potential == "zero" and settings.episode_end == "terminal":
        after = np.where(ends, 0.0, after)
    weight = alpha(variant, alpha0, env_steps)
    if settings.form == "dynamic":
        return discount * alpha(variant, alpha0, env_steps + 1) * after - weight * before
    return weight * (discount * after - before)
