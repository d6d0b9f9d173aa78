"""Schedules of the shaping weight, as shares of alpha0. One record each; its name is the name in the configuration.

They are looked up by name, so that adding one leaves the trainings that use another as they are. A name that begins
with an underscore is no schedule.
"""

from collections.abc import Callable

import numpy as np

from reacher_shaping.settings.cell import Variant
from reacher_shaping.training.shaping import Array, Schedule


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


constant = _stateless(_always_one)
"""1 for ever (paper, section 3.4)."""
linear = _stateless(_falling_line)
"""max(0, 1 - t / T) after t environment steps, with the variant's horizon T (paper, section 3.4)."""
