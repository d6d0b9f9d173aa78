"""What trained policies do on episodes longer than the 50 steps they were trained on."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from reacher_shaping.evaluate import Actor, Mode, evaluate
from reacher_shaping.reacher import EPISODE_STEPS

LENGTHS = (EPISODE_STEPS, 100, 200, 500)
"""Environment steps of an episode; 50 is Reacher-v5's own, 500 are 10 simulated seconds."""
EPISODES = 50
"""Episodes a run and length: few, since a cell's interval is over its seeds, which differ by more."""


def evaluate_lengths(
    act: Actor,
    seeds: Sequence[int],
    *,
    mode: Mode,
    radius: float,
    control_weight: float,
    root_seed: int,
    clip_actions: bool = False,
    episodes: int = EPISODES,
    lengths: Sequence[int] = LENGTHS,
) -> pd.DataFrame:
    """Return a row per seed and length; the other arguments are those of `evaluate.evaluate`.

    Columns: `seed, mode, steps, episodes`, then means over the episodes: `success_rate` (within `radius` m after any
    step), `final_success_rate`, `final_distance` (m), `return_per_step`, and `share_within_radius`, the share of
    steps that ended within `radius`. The targets are the same for all lengths; with 50 steps the episodes are the
    first of the study's evaluation.
    """
    rows = []
    for steps in lengths:
        watched = _Watched(act, steps, radius)
        frame = evaluate(
            watched,
            seeds,
            mode=mode,
            episodes=episodes,
            radius=radius,
            control_weight=control_weight,
            root_seed=root_seed,
            clip_actions=clip_actions,
            steps=steps,
        )
        grouped = frame.groupby("seed", sort=False)
        after_last = grouped["final_success"].sum().to_numpy()
        rows.append(
            pd.DataFrame(
                {
                    "seed": list(seeds),
                    "mode": mode,
                    "steps": steps,
                    "episodes": episodes,
                    "success_rate": grouped["success"].mean().to_numpy(),
                    "final_success_rate": grouped["final_success"].mean().to_numpy(),
                    "final_distance": grouped["final_distance"].mean().to_numpy(),
                    "return_per_step": grouped["episode_return"].mean().to_numpy() / steps,
                    "share_within_radius": (watched.within(episodes) + after_last) / (episodes * steps),
                }
            )
        )
    return pd.concat(rows, ignore_index=True).sort_values(["seed", "steps"], kind="stable", ignore_index=True)


class _Watched:
    """An actor that counts, per seed and episode, the steps that ended within the radius, but for the last one.

    It sees the state before each step: of T steps the states after the first T - 1, and the reset's, left out here.
    """

    def __init__(self, act: Actor, steps: int, radius: float) -> None:
        self._act, self._steps, self._radius = act, steps, radius
        self._calls = 0
        self._counts: list[NDArray[np.int64]] = []

    def __call__(self, observation: NDArray[np.float64], noise: NDArray[np.float32] | None) -> NDArray[np.floating]:
        """Act on observations [S, L, 10]."""
        if self._calls % self._steps == 0:
            self._counts.append(np.zeros(observation.shape[:2], dtype=np.int64))
        else:
            self._counts[-1] += np.linalg.norm(observation[..., 8:10], axis=-1) <= self._radius
        self._calls += 1
        return self._act(observation, noise)

    def within(self, episodes: int) -> NDArray[np.int64]:
        """Return the steps counted in the first `episodes` episodes of each seed [S]."""
        counts: NDArray[np.int64] = np.concatenate(self._counts, axis=1)[:, :episodes].sum(axis=1)
        return counts
