"""Evaluation: episodes of any policy on the same resets, one row per episode.

Every policy meets the same resets and, in stochastic mode, the same standard normal draws, so all
comparisons are paired by episode.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from reacher_shaping.random_streams import Purpose, stream
from reacher_shaping.tasks.reacher import ACTION_SIZE, EPISODE_STEPS, Lanes, control_cost, draw_reset

Array = NDArray[np.float64]
Mode = Literal["stochastic", "deterministic"]
Actor = Callable[[Array, NDArray[np.float32] | None], NDArray[np.floating]]
"""(observations [S, L, 10], standard normal noise [S, L, 2] or None) -> torques [S, L, 2]."""
LANES_PER_SEED = 50
"""Episodes of one seed that run side by side; fixed, so that results never depend on a chunk's size."""


def evaluate(
    act: Actor,
    seeds: Sequence[int],
    *,
    mode: Mode,
    episodes: int,
    radius: float,
    control_weight: float,
    root_seed: int,
    clip_actions: bool = False,
    steps: int = EPISODE_STEPS,
) -> pd.DataFrame:
    """Return the columns of `episodes.parquet`, a row per seed and episode, ordered by seed.

    Args:
        act: the policies of all seeds.
        seeds: names of the S policies in the rows.
        mode: "stochastic" samples actions (the paper's evaluation), "deterministic" takes the mean.
        episodes: episodes a seed.
        radius: m; success is a distance of at most `radius` after any step, final success after the last.
        control_weight: w of the reward -d - w ||a||^2.
        root_seed: keys the resets and the noise, common to all policies.
        clip_actions: clip torques to [-1, 1] before the step, so that the control cost is on the clipped.
        steps: length of an episode; Reacher-v5's is 50.
    """
    lanes = Lanes(len(seeds) * LANES_PER_SEED)
    shape = (len(seeds), LANES_PER_SEED)
    chunks = []
    for resets, noise in _chunks(episodes, steps, root_seed):
        distance = np.empty((*shape, steps))
        control = np.empty((*shape, steps))
        lanes.reset(resets * len(seeds))
        for t in range(steps):
            draws = np.broadcast_to(noise[:, t], (*shape, ACTION_SIZE)).copy() if mode == "stochastic" else None
            action = act(lanes.observation.reshape(*shape, -1), draws)
            if clip_actions:
                action = action.clip(-1.0, 1.0)
            lanes.step(action.reshape(-1, ACTION_SIZE))
            distance[..., t] = lanes.distance.reshape(shape)
            control[..., t] = control_weight * control_cost(action)
        chunks.append((distance, control))
    distance, control = (np.concatenate(parts, axis=1)[:, :episodes] for parts in zip(*chunks, strict=True))
    return _rows(distance, control, seeds, mode, radius)


def _chunks(
    episodes: int, steps: int, root_seed: int
) -> Iterator[tuple[list[tuple[Array, Array]], NDArray[np.float32]]]:
    """Yield the resets and the noise [L, T, 2] of L episodes at a time; the last chunk may overshoot."""
    resets = stream(root_seed, Purpose.EVALUATION_RESETS)
    noise = stream(root_seed, Purpose.EVALUATION_ACTIONS)
    for _ in range(0, episodes, LANES_PER_SEED):
        draws = noise.standard_normal((LANES_PER_SEED, steps, ACTION_SIZE), dtype=np.float32)
        yield [draw_reset(resets) for _ in range(LANES_PER_SEED)], draws


def _rows(distance: Array, control: Array, seeds: Sequence[int], mode: Mode, radius: float) -> pd.DataFrame:
    """Return the rows of episodes given distances and weighted control costs [S, E, T]."""
    count, episodes, _ = distance.shape
    hit = distance <= radius
    success = hit.any(-1)
    first = pd.array(hit.argmax(-1).ravel() + 1, dtype="Int32")
    first[~success.ravel()] = pd.NA
    reward_distance, reward_control = -distance.sum(-1), -control.sum(-1)
    return pd.DataFrame(
        {
            "seed": np.repeat(seeds, episodes),
            "mode": mode,
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
