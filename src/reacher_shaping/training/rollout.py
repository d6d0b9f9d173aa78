"""Collection of one rollout for all seeds: the episodes of a rollout run side by side as lanes.

The policy is fixed during a rollout and every episode starts from its own reset, so the episodes do
not depend on each other: 2048 sequential steps are 40 episodes of 50 steps and one of 48, and become
50 lock-steps of 41 lanes a seed.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from reacher_shaping.random_streams import Purpose, stream
from reacher_shaping.tasks.base import Lanes, Task, control_cost
from reacher_shaping.training.policy import Policy

Array = NDArray[np.float64]
Stack = TypeVar("Stack", NDArray[Any], Tensor)


@dataclass(frozen=True)
class RolloutLayout:
    """How the `steps` of a rollout are laid out in lanes of T = `episode_steps`; only the last may be shorter."""

    steps: int
    episode_steps: int

    @cached_property
    def lengths(self) -> NDArray[np.int64]:
        """[L] environment steps of each lane."""
        full, rest = divmod(self.steps, self.episode_steps)
        return np.array([self.episode_steps] * full + [rest] * (rest > 0))

    @property
    def lanes(self) -> int:
        """L."""
        return len(self.lengths)

    @property
    def episodes(self) -> int:
        """Lanes that reach the time limit: the episodes a Monitor would log."""
        return self.steps // self.episode_steps

    @cached_property
    def episode_ends(self) -> NDArray[np.bool_]:
        """[L, T] true at each lane's last step."""
        return np.equal(np.arange(self.episode_steps), self.lengths[:, None] - 1)

    @cached_property
    def order(self) -> NDArray[np.int64]:
        """[L, T] position of each step in the sequential rollout."""
        return np.arange(self.lanes)[:, None] * self.episode_steps + np.arange(self.episode_steps)

    def sequence(self, values: Stack) -> Stack:
        """Return the steps the sequential loop takes, [S, N, ...] in its order, of values [S, L, T, ...]."""
        return values.reshape(len(values), self.lanes * self.episode_steps, *values.shape[3:])[:, : self.steps]


@dataclass(frozen=True)
class Rollout:
    """What one rollout recorded; where the layout takes no step the numbers are to be ignored.

    Attributes:
        observation: [S, L, T+1, F], s_0 .. s_T.
        measured: [S, L, T+1, M], what the task measures in them.
        action: [S, L, T, A] as sampled (the loss sees these, also if clipped for the step).
        control: [S, L, T] ||a||^2 of the actions applied.
    """

    observation: Array
    measured: Array
    action: NDArray[np.float32]
    control: NDArray[np.float32]

    @property
    def distance(self) -> Array:
        """[S, L, T+1] m, to the goal."""
        return self.measured[..., 0]


class Collector:
    """Collects rollouts for S seeds; holds the lanes and the streams' keys."""

    def __init__(
        self, task: Task, seeds: Sequence[int], root_seed: int, layout: RolloutLayout, *, clip_actions: bool = False
    ) -> None:
        """Allocate S x L lanes."""
        self.task = task
        self.seeds = list(seeds)
        self.root_seed = root_seed
        self.layout = layout
        self.clip_actions = clip_actions
        self.lanes = Lanes(task, len(self.seeds) * layout.lanes)

    def collect(self, policy: Policy, iteration: int) -> Rollout:
        """Run one rollout of `iteration` (counted from 0) with `policy` fixed."""
        task, shape, times = self.task, (len(self.seeds), self.layout.lanes), self.layout.episode_steps
        observation = np.empty((*shape, times + 1, task.observation_size))
        measured = np.empty((*shape, times + 1, len(task.measures)))
        action = np.empty((*shape, times, task.action_size), dtype=np.float32)
        noise = self._noise(iteration)
        lanes = self.lanes
        lanes.reset(self.resets(iteration))
        for t in range(times):
            observation[:, :, t] = lanes.observation.reshape(*shape, -1)
            measured[:, :, t] = lanes.measured.reshape(*shape, -1)
            action[:, :, t] = policy.act(observation[:, :, t], noise[:, :, t])
            lanes.step(self._applied(action[:, :, t]).reshape(-1, task.action_size))
        observation[:, :, -1] = lanes.observation.reshape(*shape, -1)
        measured[:, :, -1] = lanes.measured.reshape(*shape, -1)
        return Rollout(observation, measured, action, control_cost(self._applied(action)))

    def resets(self, iteration: int) -> list[Array]:
        """Return the reset of each lane [D], seed by seed."""
        generators = [stream(self.root_seed, Purpose.RESETS, seed, iteration) for seed in self.seeds]
        return [self.task.draw_reset(generator) for generator in generators for _ in range(self.layout.lanes)]

    def _applied(self, action: NDArray[np.float32]) -> NDArray[np.float32]:
        limit = self.task.action_limit
        return action.clip(-limit, limit) if self.clip_actions else action

    def _noise(self, iteration: int) -> NDArray[np.float32]:
        shape = (self.layout.lanes, self.layout.episode_steps, self.task.action_size)
        generators = [stream(self.root_seed, Purpose.ACTIONS, seed, iteration) for seed in self.seeds]
        return np.stack([generator.standard_normal(shape, dtype=np.float32) for generator in generators])
