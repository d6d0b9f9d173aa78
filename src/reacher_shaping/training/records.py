"""What a potential and a schedule are to training: records of functions, with a state per seed where they learn."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from reacher_shaping.settings.cell import Variant

Array = NDArray[np.float64]
State = dict[str, Array]
"""What a schedule or a potential keeps, by name; each with the seeds [S] as first axis."""


class Schedule(NamedTuple):
    """A share of alpha0 that depends on the steps of training, and perhaps on how each seed fares.

    Attributes:
        start: the state before the first iteration, of a number of seeds S; empty where there is nothing to keep.
        weight: (variant, state, environment steps of training done [...]) -> share of alpha0, [...] or [S, ...].
        update: (variant, state, measures of the iteration by name, [S] each) -> the state of the next iteration.
            No number of one seed may meet one of another.
        aligned: whether the measures shall hold `alignment`, see `training.alignment`.
    """

    start: Callable[[int], State]
    weight: Callable[[Variant, State, Array], Array]
    update: Callable[[Variant, State, Mapping[str, Array]], State]
    aligned: bool = False


class Transitions(NamedTuple):
    """The N steps of an iteration, as a potential may learn from them.

    Attributes:
        before: [S, N] m, distance to the goal before each step.
        after: [S, N] m, after it.
        reward: [S, N], unshaped.
        discount: gamma.
    """

    before: Array
    after: Array
    reward: Array
    discount: float


class Potential(NamedTuple):
    """A potential that is learned meanwhile.

    Attributes:
        start: the state before the first iteration, of a number of seeds S.
        value: (state, distances [S, ...] m) -> Phi [S, ...].
        update: (variant, state, the iteration's transitions) -> the state of the next iteration. No number of one seed
            may meet one of another.
    """

    start: Callable[[int], State]
    value: Callable[[State, Array], Array]
    update: Callable[[Variant, State, Transitions], State]
