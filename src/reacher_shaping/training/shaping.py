"""Potential-based reward shaping: the shaped rewards of a rollout. Pure functions on arrays.

r'(s, a, s', t) = r + alpha(t) (gamma Phi(s') - Phi(s))    (paper, section 3.4)
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from reacher_shaping.settings.cell import Cell, Shaping, Variant
from reacher_shaping.training.records import Array, Potential, Schedule, State


def fixed(function: Callable[[Array], Array]) -> Potential:
    """Return a potential that learns nothing as the record of one."""
    return Potential(
        start=lambda seeds: {},
        value=lambda state, distance: function(distance),
        update=lambda variant, state, steps: {},
    )


@dataclass(frozen=True)
class Rule:
    """The shaping of a cell.

    Attributes:
        potential: Phi of distances to the goal.
        schedule: of the weight.
        variant: the settings of both.
        alpha0: weight where the schedule gives 1.
        discount: gamma.
        settings: `form` "paper" is alpha(t) (gamma Phi' - Phi); "dynamic" is gamma alpha(t+1) Phi' -
            alpha(t) Phi, which leaves the optimal policy unchanged for any alpha(t) (Devlin & Kudenko
            2012, eq. 3). `terminal_potential` "zero" takes Phi = 0 in the state after a last step,
            which invariance needs if that state's value counts as zero (Grzes 2017); the paper keeps
            it. With "bootstrap" ends the next state's value counts, so its potential is always kept.
            "hurl" is heuristic-guided learning (Cheng, Kolobov & Swaminathan 2021, eq. 4): r + (1 - l) gamma h(s'),
            with the discount l gamma and l = 1 - `mixing` times the schedule's share; h = alpha0 Phi is a guess of the
            value. It shortens the horizon as long as l is below 1.
    """

    potential: Potential
    schedule: Schedule
    variant: Variant
    alpha0: float
    discount: float
    settings: Shaping

    @classmethod
    def of(cls, cell: Cell) -> "Rule":
        """Return a cell's rule.

        `start_weight` "one" starts every weight at 1, as the code released with the paper does.
        """
        settings = cell.protocol.shaping
        potential = getattr(import_module("reacher_shaping.training.potentials"), cell.potential)
        potential = potential if isinstance(potential, Potential) else fixed(potential)
        schedule = getattr(import_module("reacher_shaping.training.schedules"), cell.variant.schedule)
        alpha0 = 1.0 if settings.start_weight == "one" else cell.alpha0
        return cls(potential, schedule, cell.variant, alpha0, cell.protocol.ppo.discount, settings)

    def start(self, seeds: int) -> State:
        """Return the state of schedule and potential before the first iteration."""
        return {**self.schedule.start(seeds), **self.potential.start(seeds)}

    @property
    def learns(self) -> bool:
        """Whether the potential has a state, and so needs the steps of an iteration."""
        return bool(self.potential.start(1))

    def update(self, state: State, measured: Mapping[str, Any]) -> State:
        """Return the state of the next iteration from the measures of this one, its `transitions` where it learns."""
        learned = self.potential.update(self.variant, state, measured["transitions"]) if self.learns else {}
        return {**self.schedule.update(self.variant, state, measured), **learned}

    def alpha(self, state: State, env_steps: ArrayLike) -> Array:
        """Return the shaping weight after `env_steps` environment steps of training [...]: [...] or [S, ...]."""
        return self.alpha0 * self.schedule.weight(self.variant, state, np.asarray(env_steps, dtype=np.float64))

    def discount_at(self, state: State, env_steps: int) -> float:
        """Return the discount of the iteration that begins after `env_steps` environment steps of training."""
        if self.settings.form != "hurl":
            return self.discount
        return self.discount * (1 - self._mixing(state, env_steps))

    def _mixing(self, state: State, env_steps: int) -> float:
        """Return 1 - l of an iteration; the settings refuse a schedule with a state, which has one for each seed."""
        return self.settings.mixing * float(self.alpha(state, env_steps)) / self.alpha0

    def reward(
        self, distance: Array, env_steps: NDArray[np.int64], episode_ends: NDArray[np.bool_], state: State
    ) -> Array:
        """Return the shaping term F [S, L, T] of every step of a rollout.

        Args:
            distance: [S, L, T+1] m, to the goal in s_0 .. s_T.
            env_steps: [L, T] environment steps of training done before each step: t of alpha(t).
            episode_ends: [L, T] true at a lane's last step, where the episode (or the rollout) is cut.
            state: of schedule and potential.
        """
        phi = self.potential.value(state, np.asarray(distance, dtype=np.float64))
        before, after = phi[..., :-1], phi[..., 1:]
        if self.settings.terminal_potential == "zero" and self.settings.episode_end == "terminal":
            after = np.where(episode_ends, 0.0, after)
        if self.settings.form == "hurl":
            return self._mixing(state, int(env_steps.flat[0])) * self.discount * self.alpha0 * after
        weight = self.alpha(state, env_steps)
        if self.settings.form == "dynamic":
            return self.discount * self.alpha(state, env_steps + 1) * after - weight * before
        return weight * (self.discount * after - before)
