"""Schedules of the shaping weight, as shares of alpha0. One record each; its name is the name in the configuration.

They are looked up by name, so that adding one leaves the trainings that use another as they are. A name that begins
with an underscore is no schedule.
"""

from collections.abc import Callable, Mapping

import numpy as np

from reacher_shaping.settings.cell import Variant
from reacher_shaping.training.records import Array, Schedule, State

_RANGE = (1e-3, 10.0)
"""Shares of alpha0 that an aligned weight stays within."""


def _stateless(weight: Callable[[Variant, Array], Array]) -> Schedule:
    """Return a schedule of the variant and the environment steps alone."""
    return Schedule(
        start=lambda seeds: {},
        weight=lambda variant, state, env_steps: weight(variant, env_steps),
        update=lambda variant, state, measured: state,
    )


def _always_one(variant: Variant, env_steps: Array) -> Array:
    return np.ones_like(env_steps)


def _falling_line(variant: Variant, env_steps: Array) -> Array:
    assert variant.horizon is not None, "settings refuse a linear schedule without a horizon"
    return np.maximum(0.0, 1.0 - env_steps / variant.horizon)


def _falling_exponential(variant: Variant, env_steps: Array) -> Array:
    assert variant.horizon is not None, "settings refuse an exponential schedule without a horizon"
    return np.exp(-env_steps / variant.horizon)


def _half_cosine(variant: Variant, env_steps: Array) -> Array:
    assert variant.horizon is not None, "settings refuse a cosine schedule without a horizon"
    return 0.5 * (1.0 + np.cos(np.pi * np.minimum(1.0, env_steps / variant.horizon)))


def _per_seed(values: Array, env_steps: Array) -> Array:
    """Return values [S] as [S, 1, ..., 1], to stand beside environment steps [...]."""
    return values.reshape(-1, *[1] * env_steps.ndim)


def _averaged_success(variant: Variant, state: State, measured: Mapping[str, Array]) -> State:
    assert variant.rate is not None, "settings refuse a success schedule without a rate"
    return {"success": state["success"] + variant.rate * (measured["success_rate"] - state["success"])}


def _followed_alignment(variant: Variant, state: State, measured: Mapping[str, Array]) -> State:
    assert variant.rate is not None, "settings refuse a bilevel schedule without a rate"
    return {"log": np.clip(state["log"] + variant.rate * measured["alignment"], *np.log(_RANGE))}


constant = _stateless(_always_one)
"""1 for ever (paper, section 3.4)."""
linear = _stateless(_falling_line)
"""max(0, 1 - t / T) after t environment steps, with the variant's horizon T (paper, section 3.4)."""
exponential = _stateless(_falling_exponential)
"""exp(-t / T): falls to 1 / e at the horizon T and never ends, as a learning rate often does."""
cosine = _stateless(_half_cosine)
"""Half a cosine from 1 to 0 at the horizon T (Loshchilov & Hutter 2017, eq. 5, without restarts)."""
success = Schedule(
    start=lambda seeds: {"success": np.zeros(seeds)},
    weight=lambda variant, state, env_steps: _per_seed(1.0 - state["success"], env_steps),
    update=_averaged_success,
)
"""1 less the moving average of the seed's own success in training, so that shaping fades as the task is learned.

The reward-adaptive decay that the paper names as future work (section 6); the average moves by the variant's rate an
iteration: s <- s + rate (success - s), from 0.
"""
bilevel = Schedule(
    start=lambda seeds: {"log": np.zeros(seeds)},
    weight=lambda variant, state, env_steps: _per_seed(np.exp(state["log"]), env_steps),
    update=_followed_alignment,
    aligned=True,
)
"""A weight that grows while shaping pulls where the task's own return does, and shrinks where it pulls against it.

Multiplied each iteration by exp(rate cos), cos the cosine of their policy gradients: the scalar case of the bi-level
weights of Hu et al. 2020 ("Learning to utilize shaping rewards"), with the gradient of the outer level taken as Du et
al. 2018 take it ("Adapting auxiliary losses using gradient similarity"). It stays between a thousandth and ten times
alpha0.
"""
