"""What trained policies do on episodes longer than the 50 steps they were trained on."""

from collections.abc import Sequence
from dataclasses import replace

import pandas as pd

from reacher_shaping.evaluation.evaluate import Actor, Conditions, evaluate

LENGTHS = (50, 100, 200, 500)
"""Environment steps of an episode; 50 is Reacher-v5's own, 500 are 10 simulated seconds."""
EPISODES = 50
"""Episodes a run and length: few, since a cell's interval is over its seeds, which differ by more."""


def evaluate_lengths(
    act: Actor, seeds: Sequence[int], conditions: Conditions, lengths: Sequence[int] = LENGTHS
) -> pd.DataFrame:
    """Return a row per seed and length, under conditions that are equal but for it.

    Columns: `seed, mode, steps, episodes`, then means over the episodes: `success_rate` (within the success radius
    after any step), `final_success_rate`, `final_distance` (m), `return_per_step`, and `share_within_radius`, the share
    of steps that ended within it. The targets are the same for all lengths; with 50 steps the episodes are the
    first of the study's evaluation.
    """
    rows = []
    for steps in lengths:
        grouped = evaluate(act, seeds, replace(conditions, steps=steps)).groupby("seed", sort=False)
        rows.append(
            pd.DataFrame(
                {
                    "seed": list(seeds),
                    "mode": conditions.mode,
                    "steps": steps,
                    "episodes": conditions.episodes,
                    "success_rate": grouped["success"].mean().to_numpy(),
                    "final_success_rate": grouped["final_success"].mean().to_numpy(),
                    "final_distance": grouped["final_distance"].mean().to_numpy(),
                    "return_per_step": grouped["episode_return"].mean().to_numpy() / steps,
                    "share_within_radius": grouped["share_within_radius"].mean().to_numpy(),
                }
            )
        )
    return pd.concat(rows, ignore_index=True).sort_values(["seed", "steps"], kind="stable", ignore_index=True)
