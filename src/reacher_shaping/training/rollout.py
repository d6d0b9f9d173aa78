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
from reacher_shaping.tasks.reacher import ACTION_SIZE, EPISODE_STEPS, OBSERVATION_SIZE, Lanes, control_cost, draw_reset
from reacher_shaping.training.policy import Policy

Array = NDArray[np.float64]
Stack = TypeVar("Stack", NDArray[Any], Tensor)


@dataclass(frozen=True)
class Plan:
    """How the `steps` of a rollout are laid out in lanes; only the last lane may be shorter than T."""

    steps: int

    @cached_property
    def lengths(self) -> NDArray[np.int64]:
        """[L] environment steps of each lane."""
        full, rest = divmod(self.steps, EPISODE_STEPS)
        return np.array([EPISODE_STEPS] * full + [rest] * (rest > 0))

    @property
    def lanes(self) -> int:
        """L."""
        return len(self.lengths)

    @property
    def episodes(self) -> int:
        """Lanes that reach the time limit: the episodes a Monitor would log."""
        return self.steps // EPISODE_STEPS

    @cached_property
    def ends(self) -> NDArray[np.bool_]:
        """[L, T] true at each lane's last step."""
        return np.equal(np.arange(EPISODE_STEPS), self.lengths[:, None] - 1)

    @cached_property
    def order(self) -> NDArray[np.int64]:
        """[L, T] position of each step in the sequential rollout."""
        return np.arange(self.lanes)[:, None] * EPISODE_STEPS + np.arange(EPISODE_STEPS)

    def sequence(self, values: Stack) -> Stack:
        """Return the steps the sequential loop takes, [S, N, ...] in its order, of values [S, L, T, ...]."""
        return values.reshape(len(values), self.lanes * EPISODE_STEPS, *values.shape[3:])[:, : self.steps]


@dataclass(frozen=True)
class Rollout:
    """What one rollout recorded; where the plan takes no step the numbers are to be ignored.

    Attributes:
        observation: [S, L, T+1, 10], s_0 .. s_T.
        distance: [S, L, T+1] m, tip to target.
        action: [S, L, T, 2] torques as sampled (the loss sees these, also if clipped for the step).
        control: [S, L, T] ||a||^2 of the torques applied.
    """

    observation: Array
    distance: Array
    action: NDArray[np.float32]
    control: NDArray[np.float32]


class Collector:
    """Collects rollouts for S seeds; holds the lanes and the streams' keys."""

    def __init__(self, seeds: Sequence[int], root_seed: int, plan: Plan, *, clip_actions: bool = False) -> None:
        """Allocate S x L lanes."""
        self.seeds = list(seeds)
        self.root_seed = root_seed
        self.plan = plan
        self.clip_actions = clip_actions
        self.lanes = Lanes(len(self.seeds) * plan.lanes)

    def collect(self, policy: Policy, iteration: int) -> Rollout:
        """Run one rollout of `iteration` (counted from 0) with `policy` fixed."""
        shape = (len(self.seeds), self.plan.lanes)
        observation = np.empty((*shape, EPISODE_STEPS + 1, OBSERVATION_SIZE))
        distance = np.empty((*shape, EPISODE_STEPS + 1))
        action = np.empty((*shape, EPISODE_STEPS, ACTION_SIZE), dtype=np.float32)
        noise = self._noise(iteration)
        lanes = self.lanes
        lanes.reset(self.resets(iteration))
        for t in range(EPISODE_STEPS):
            observation[:, :, t] = lanes.observation.reshape(*shape, -1)
            distance[:, :, t] = lanes.distance.reshape(shape)
            action[:, :, t] = policy.act(observation[:, :, t], noise[:, :, t])
            lanes.step(self._applied(action[:, :, t]).reshape(-1, ACTION_SIZE))
        observation[:, :, -1] = lanes.observation.reshape(*shape, -1)
        distance[:, :, -1] = lanes.distance.reshape(shape)
        return Rollout(observation, distance, action, control_cost(self._applied(action)))

    def resets(self, iteration: int) -> list[tuple[Array, Array]]:
        """Return the start of each lane, seed by seed: (joint positions [4], joint velocities [4])."""
        generators = [stream(self.root_seed, Purpose.RESETS, seed, iteration) for seed in self.seeds]
        return [draw_reset(generator) for generator in generators for _ in range(self.plan.lanes)]

    def _applied(self, action: NDArray[np.float32]) -> NDArray[np.float32]:
        return action.clip(-1.0, 1.0) if self.clip_actions else action

    def _noise(self, iteration: int) -> NDArray[np.float32]:
        shape = (self.plan.lanes, EPISODE_STEPS, ACTION_SIZE)
        generators = [stream(self.root_seed, Purpose.ACTIONS, seed, iteration) for seed in self.seeds]
        return np.stack([generator.standard_normal(shape, dtype=np.float32) for generator in generators])


def environment_reward(distance: Array, control: NDArray[np.floating], control_weight: float) -> Array:
    """Return r [S, L, T] = -||tip - target|| - w ||a||^2 (paper, section 3.1).

    Args:
        distance: [S, L, T+1] m; the reward of a step reads the distance after it.
        control: [S, L, T] ||a||^2, in the precision of the action: Gymnasium weighs it in that precision too.
        control_weight: w; 0.1 in the paper's text, 1 in Gymnasium's code.
    """
    return -distance[..., 1:] - control_weight * control
