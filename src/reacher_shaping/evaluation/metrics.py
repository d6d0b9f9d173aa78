"""Metrics of one run from its evaluation episodes."""

import pandas as pd

EVALUATION = [
    "success_rate",
    "mean_return",
    "final_success_rate",
    "final_distance",
    "min_distance",
    "reward_distance",
    "reward_control",
    "first_hit_step",
    "share_within_radius",
]


def evaluation_metrics(episodes: pd.DataFrame, mode: str) -> pd.DataFrame:
    """One row per seed (index) of one mode's evaluation: `episodes` and the columns of `EVALUATION`."""
    groups = episodes[episodes["mode"] == mode].groupby("seed")
    columns = {
        "episodes": groups.size(),
        "success_rate": groups["success"].mean(),
        "mean_return": groups["episode_return"].mean(),
        "final_success_rate": groups["final_success"].mean(),
    }
    for name in EVALUATION[3:]:
        columns[name] = groups[name].mean()
    return pd.DataFrame(columns).astype(dict.fromkeys(EVALUATION, float))
