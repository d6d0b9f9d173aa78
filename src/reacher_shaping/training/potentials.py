"""Potentials Phi(s) of the distance to the goal. One function each; its name is the name in the configuration.

Each takes distances (any shape, m) and returns Phi of that shape. They are looked up by name, so that adding one leaves
the trainings that use another as they are. Names that begin with an underscore are no potentials.
"""

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[np.float64]


def none(distance: _Array) -> _Array:
    """Return 0: no shaping."""
    return np.zeros_like(distance)


def l2(distance: _Array) -> _Array:
    """Return -d (paper, section 3.3)."""
    return np.negative(distance)


def l2sq(distance: _Array) -> _Array:
    """Return -d^2 (paper, section 3.3)."""
    return np.negative(np.square(distance))
