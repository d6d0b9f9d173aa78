"""Where in the plane of the targets policies end at them and where they do not."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from reacher_shaping.labels import KEY
from reacher_shaping.random_streams import Purpose, stream
from reacher_shaping.tasks import reacher

SQUARE = 0.04
"""Side in m of the squares that targets are counted in: about 10 of 1000 episodes in each."""
COLUMNS = [*KEY, "target_x", "target_y", "episodes", "final_success_rate"]


def reacher_targets(root_seed: int, episodes: int) -> NDArray[np.float64]:
    """Return the target [E, 2] in m of each of Reacher's evaluation episodes, the same for every policy."""
    resets = stream(root_seed, Purpose.EVALUATION_RESETS)
    return reacher.target_position(np.stack([reacher.draw_reset(resets) for _ in range(episodes)]))[:, :2]


def target_map(episodes: pd.DataFrame, targets: NDArray[np.float64]) -> pd.DataFrame:
    """A row per cell and square: over all episodes of the cell's runs, the share that ends within the success radius.

    Args:
        episodes: `episodes.parquet` of runs with the columns of their cells' keys; the stochastic ones count.
        targets: [E, 2] in m, of each episode by its number.

    Columns: the key, `target_x, target_y` (the middle of the square in m), `episodes` and `final_success_rate`.
    """
    shown = episodes[episodes["mode"] == "stochastic"]
    middles = (np.floor(targets[shown["episode"].to_numpy()] / SQUARE) + 0.5) * SQUARE
    shown = shown.assign(target_x=middles[:, 0].round(6), target_y=middles[:, 1].round(6))
    counted = shown.groupby([*KEY, "target_x", "target_y"], sort=True)["final_success"].agg(["size", "mean"])
    return counted.reset_index().set_axis(COLUMNS, axis=1)
