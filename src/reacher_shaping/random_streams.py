"""Random streams keyed by what they are for, never carried from one use to the next.

A stream is a function of (root seed, purpose, run seed, iteration) alone. So a run does not depend
on the block it is trained in, a resumed run equals an uninterrupted one, and one run seed meets the
same resets and the same action noise under every variant (common random numbers).
"""

import zlib
from collections.abc import Hashable
from enum import IntEnum

import numpy as np


def generator(root_seed: int, *labels: Hashable) -> np.random.Generator:
    """A generator keyed by its purpose, so no interval depends on which others were computed."""
    return np.random.default_rng([root_seed, zlib.crc32("/".join(map(str, labels)).encode())])


class Purpose(IntEnum):
    """What a stream is used for; the numbers are part of every result and must not be reused."""

    INITIALISATION = 0
    RESETS = 1
    ACTIONS = 2
    SHUFFLES = 3
    EVALUATION_RESETS = 4
    EVALUATION_ACTIONS = 5
    CONTROLLER = 6


def stream(root_seed: int, purpose: Purpose, seed: int = 0, iteration: int = 0) -> np.random.Generator:
    """Return the generator of one purpose.

    Episodes of a rollout draw from it one after the other, in order, so its first k episodes are the
    same however many follow. Raises ValueError for a negative key (numpy's own message).
    """
    key = np.random.SeedSequence(root_seed, spawn_key=(int(purpose), seed, iteration))
    return np.random.Generator(np.random.PCG64(key))
