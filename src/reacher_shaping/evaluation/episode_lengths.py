"""What trained policies do on episodes longer than the 50 steps they were trained on."""

from collections.abc import Sequence

import pandas as pd

from reacher_shaping.evaluation.evaluate import Actor, Mode, evaluate
from reacher_shaping.settings.cell import Environment

LENGTHS = (50, 100, 200, 500)
"""Environment steps of an episode; 50 is Reacher-v5's own, 500 are 10 simulated seconds."""
EPISODES = 50
"""Episodes a run and length: few, since a cell's interval is over its seeds, which differ by more."""


def evaluate_lengths(
    act: Actor,
    seeds: Sequence[int],
    *,
    mode: Mode,
    radius: float,
    environment: Environment,
    root_seed: int,
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
        frame = evaluate(
            act,
            seeds,
            mode=mode,
            episodes=episodes,
            radius=radius,
            environment=environment,
            root_seed=root_seed,
            steps=steps,
        )
        grouped = frame.groupby("seed", sort=False)
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
                    "share_within_radius": grouped["share_within_radius"].mean().to_numpy(),
                }
            )
        )
    return pd.concat(rows, ignore_index=True).sort_values(["seed", "steps"], kind="stable", ignore_index=True)
