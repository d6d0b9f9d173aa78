"""Training curves: progress of single runs in, one mean curve with a band per cell out."""

import pandas as pd


def curve_table(progress: pd.DataFrame, resamples: int = 2000) -> pd.DataFrame:
    """Mean unshaped episode return per cell and iteration with a 95 % bootstrap band over seeds.

    `progress` holds the cell's key (`protocol, variant, budget, alpha0`) and the columns of
    `progress.parquet`. Result: `protocol, variant, budget, alpha0, iteration, env_steps,
    episode_return, low, high, seeds`.
    """
    raise NotImplementedError
