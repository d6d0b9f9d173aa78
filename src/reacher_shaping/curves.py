"""Training curves: the progress of single runs in, one mean curve with a band per cell out."""

import numpy as np
import pandas as pd
from scipy import stats

CELL = ["protocol", "variant", "budget", "alpha0"]


def curve_table(progress: pd.DataFrame, confidence: float = 0.95, column: str = "episode_return") -> pd.DataFrame:
    """Mean episode return per cell and iteration, with a t interval over seeds; unshaped unless another `column`.

    `progress` holds the cell's key (`protocol, variant, budget, alpha0`) beside the columns of
    `progress.parquet`. The result has a row per cell and iteration: the key, `iteration`,
    `env_steps`, `episode_return`, `low`, `high`, `seeds`. A return that is not finite counts as
    missing, so `seeds` is the number of runs behind a point; one seed gives no band (NaN).
    """
    finite = progress.assign(episode_return=progress[column].replace([np.inf, -np.inf], np.nan))
    keys = [*CELL, "iteration", "env_steps"]
    found = finite.groupby(keys, sort=True)["episode_return"].agg(["mean", "sem", "count"])
    degrees = (found["count"] - 1).clip(lower=1)
    half_width = found["sem"] * stats.t.ppf(0.5 + confidence / 2, degrees)
    return (
        pd.DataFrame(
            {
                "episode_return": found["mean"],
                "low": found["mean"] - half_width,
                "high": found["mean"] + half_width,
                "seeds": found["count"],
            }
        )
        .reset_index()
        .sort_values(keys, ignore_index=True)
    )
