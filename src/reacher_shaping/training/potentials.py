"""Potentials Phi(s) of the distance to the goal. One function each; its name is the name in the configuration.

Each takes distances (any shape, m) and returns Phi of that shape; one that is learned is a record. They are looked up
by name, so that adding one leaves the trainings that use another as they are. Names that begin with an underscore are
no potentials.
"""

import numpy as np
from numpy.typing import NDArray

from reacher_shaping.settings.cell import Variant
from reacher_shaping.training.records import Potential, State, Transitions

_Array = NDArray[np.float64]
_KNOTS = np.array([0.0, 0.01, 0.02, 0.04, 0.08, 0.16, 0.32, 0.64])
"""m; between them a learned potential is a line, beyond the last it is constant."""
_NEAR = 0.01  # m; much nearer, the logarithm of the distance rises no more


def _between(distance: _Array) -> tuple[NDArray[np.int64], _Array]:
    """Return, of distances, the knot below each and the share of the way to the next one."""
    inside = np.minimum(distance, _KNOTS[-1])
    below = np.clip(np.searchsorted(_KNOTS, inside, side="right") - 1, 0, len(_KNOTS) - 2)
    return below, (inside - _KNOTS[below]) / np.diff(_KNOTS)[below]


def _line(state: State, distance: _Array) -> _Array:
    """Return Phi [S, ...] of distances [S, ...] by each seed's own values at the knots."""
    below, share = _between(distance.reshape(len(distance), -1))
    first, second = (np.take_along_axis(state["knots"], below + following, axis=1) for following in (0, 1))
    phi: _Array = ((1 - share) * first + share * second).reshape(distance.shape)
    return phi


def _abstract_values(variant: Variant, state: State, steps: Transitions) -> State:
    """Move the value at each knot by `rate` times the mean temporal difference of the steps that begin near it."""
    assert variant.rate is not None, "settings refuse a learned potential without a rate"
    difference = steps.reward + steps.discount * _line(state, steps.after) - _line(state, steps.before)
    below, share = _between(steps.before)
    knots = state["knots"].copy()
    for seed, values in enumerate(knots):
        weight, moved = (
            np.bincount(below[seed], (1 - share[seed]) * amount, len(_KNOTS))
            + np.bincount(below[seed] + 1, share[seed] * amount, len(_KNOTS))
            for amount in (np.ones_like(difference[seed]), difference[seed])
        )
        values += variant.rate * np.divide(moved, weight, out=np.zeros_like(moved), where=weight != 0)
    return {"knots": knots}


def none(distance: _Array) -> _Array:
    """Return 0: no shaping."""
    return np.zeros_like(distance)


def l2(distance: _Array) -> _Array:
    """Return -d (paper, section 3.3)."""
    return np.negative(distance)


def l2sq(distance: _Array) -> _Array:
    """Return -d^2 (paper, section 3.3)."""
    return np.negative(np.square(distance))


def sqrt(distance: _Array) -> _Array:
    """Return -sqrt(d): the steeper, the nearer to the goal."""
    return np.negative(np.sqrt(distance))


def log(distance: _Array) -> _Array:
    """Return -log(d + 0.01 m): twenty times as steep at the goal as 0.2 m from it."""
    return np.negative(np.log(distance + _NEAR))


learned = Potential(
    start=lambda seeds: {"knots": np.zeros((seeds, len(_KNOTS)))},
    value=_line,
    update=_abstract_values,
)
"""The value function of the task seen through the distance alone, learned online by temporal differences from 0, by
the variant's rate an iteration (Grzes & Kudenko 2010, "Online learning of shaping rewards in reinforcement learning").

A multiple of the critic as potential is an offset of the critic and nothing else (Wiewiora 2003), so what this one can
bring is what a critic of eight numbers learns sooner than the network.
"""
