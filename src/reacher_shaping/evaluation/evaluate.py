"""Evaluation: episodes of any policy on the same resets, one row per episode.

Every policy meets the same resets and, in stochastic mode, the same standard normal draws, so all
comparisons are paired by episode.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from reacher_shaping.random_streams import Purpose, stream
from reacher_shaping.settings.cell import Environment
from reacher_shaping.tasks.base import Lanes, Task, control_cost, load_task

Array = NDArray[np.float64]
Mode = Literal["stochastic", "deterministic"]
Actor = Callable[[Array, NDArray[np.float32] | None], NDArray[np.floating]]
"""(observations [S, L, F], standard normal noise [S, L, A] or None) -> actions [S, L, A]."""
LANES_PER_SEED = 50
"""Episodes of one seed that run side by side; fixed, so that results never depend on a chunk's size."""


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """What policies meet in an evaluation; those that are compared meet the same.

    Attributes:
        environment: the task, its reward, and whether actions are clipped to the task's limit before the step, so that
            the control cost is on the clipped.
        root_seed: keys the resets and the noise, common to all policies.
        success_radius: m; success is a distance of at most this after any step, final success after the last.
        episodes: episodes a seed.
        mode: "stochastic" samples actions (the paper's evaluation), "deterministic" takes the mean.
        steps: length of an episode; None for the task's own.
    """

    environment: Environment
    root_seed: int
    success_radius: float
    episodes: int
    mode: Mode = "stochastic"
    steps: int | None = None


def evaluate(act: Actor, seeds: Sequence[int], conditions: Conditions) -> pd.DataFrame:
    """Return the columns of `episodes.parquet`, a row per seed and episode, ordered by seed.

    Args:
        act: the policies of all seeds.
        seeds: names of the S policies in the rows.
        conditions: what all of them meet.
    """
    environment, episodes = conditions.environment, conditions.episodes
    task = load_task(environment.task)
    steps = conditions.steps or task.episode_steps
    lanes, stochastic = Lanes(task, len(seeds) * LANES_PER_SEED), conditions.mode == "stochastic"
    shape = (len(seeds), LANES_PER_SEED)
    chunks = []
    for resets, noise in _chunks(task, episodes, steps, conditions.root_seed):
        measured = np.empty((*shape, steps, len(task.measures)))
        control = np.empty((*shape, steps))
        lanes.reset(resets * len(seeds))
        for t in range(steps):
            draws = np.broadcast_to(noise[:, t], (*shape, task.action_size)).copy() if stochastic else None
            action = act(lanes.observation.reshape(*shape, -1), draws)
            if environment.clip_actions:
                action = action.clip(-task.action_limit, task.action_limit)
            lanes.step(action.reshape(-1, task.action_size))
            measured[:, :, t] = lanes.measured.reshape(*shape, -1)
            control[..., t] = environment.control_weight * control_cost(action)
        chunks.append((measured, control))
    measured, control = (np.concatenate(parts, axis=1)[:, :episodes] for parts in zip(*chunks, strict=True))
    reward = task.rewards[environment.reward](
        measured, 0.0, control_weight=0.0, success_radius=conditions.success_radius
    )
    return _rows(reward, control, measured[..., 0], seeds, conditions)


def _chunks(task: Task, episodes: int, steps: int, root_seed: int) -> Iterator[tuple[list[Array], NDArray[np.float32]]]:
    """Yield the resets [D] and the noise [L, T, A] of L episodes at a time; the last chunk may overshoot."""
    resets = stream(root_seed, Purpose.EVALUATION_RESETS)
    noise = stream(root_seed, Purpose.EVALUATION_ACTIONS)
    for _ in range(0, episodes, LANES_PER_SEED):
        draws = noise.standard_normal((LANES_PER_SEED, steps, task.action_size), dtype=np.float32)
        yield [task.draw_reset(resets) for _ in range(LANES_PER_SEED)], draws


def _rows(reward: Array, control: Array, distance: Array, seeds: Sequence[int], conditions: Conditions) -> pd.DataFrame:
    """Return the rows of episodes given rewards but for control, weighted control costs, and distances [S, E, T]."""
    count, episodes, _ = distance.shape
    hit = distance <= conditions.success_radius
    success = hit.any(-1)
    first = pd.array(hit.argmax(-1).ravel() + 1, dtype="Int32")
    first[~success.ravel()] = pd.NA
    reward_distance, reward_control = reward.sum(-1), -control.sum(-1)
    return pd.DataFrame(
        {
            "seed": np.repeat(seeds, episodes),
            "mode": conditions.mode,
            "episode": np.tile(np.arange(episodes), count),
            "episode_return": (reward_distance + reward_control).ravel(),
            "reward_distance": reward_distance.ravel(),
            "reward_control": reward_control.ravel(),
            "min_distance": distance.min(-1).ravel(),
            "final_distance": distance[..., -1].ravel(),
            "first_hit_step": first,
            "success": success.ravel(),
            "final_success": hit[..., -1].ravel(),
            "share_within_radius": hit.mean(-1).ravel(),
        }
    )
