"""What the results of any study must satisfy: complete, finite unless diverged, within what their task allows."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import pandas as pd

from reacher_shaping.labels import KEY

RATES = ["success_rate", "final_success_rate", "deterministic_success_rate", "deterministic_final_success_rate"]
DISTANCES = ["final_distance", "min_distance"]


class Limits(NamedTuple):
    """What the results of a protocol must keep to: greatest distance in m, highest mean return."""

    distance: float
    mean_return: float


def problems(
    runs: pd.DataFrame,
    cells: pd.DataFrame,
    expected: Sequence[Mapping[str, Any]],
    *,
    seeds: int,
    episodes: int,
    limits: Mapping[str, Limits],
) -> list[str]:
    """What is wrong with the tables of runs and cells, one line each; empty if nothing is.

    expected: key columns of each cell of the study; seeds: runs of each; episodes: evaluation episodes of each run;
    limits: by protocol.
    """
    found = []
    wanted = pd.MultiIndex.from_tuples(
        [(*(cell[name] for name in KEY), seed) for cell in expected for seed in range(seeds)]
    )
    given = pd.MultiIndex.from_frame(runs[[*KEY, "seed"]])
    found += [f"run {key} is missing" for key in wanted.difference(given)]
    found += [f"run {key} is not in the study" for key in given.difference(wanted)]
    if len(cells) != len(expected):
        found.append(f"{len(cells)} cells instead of {len(expected)}")
    sound = runs[~runs["diverged"]]
    found += _offending(runs, runs["episodes"] != episodes, f"has not {episodes} episodes")
    for name in RATES:
        found += _offending(sound, ~sound[name].between(0, 1), f"has {name} outside [0, 1]")
    for protocol, (distance, mean_return) in limits.items():
        own = sound[sound["protocol"] == protocol]
        for name in DISTANCES:
            found += _offending(own, ~own[name].between(0, distance), f"has {name} outside [0, {distance:g}] m")
        found += _offending(own, ~(own["mean_return"] <= mean_return), f"has a mean return above {mean_return:g}")
    found += _offending(
        sound, sound["success_rate"] < sound["final_success_rate"], "succeeds more often at the end than ever"
    )
    return found


def _offending(runs: pd.DataFrame, where: "pd.Series[bool]", what: str) -> list[str]:
    keys = runs.loc[where, [*KEY, "seed"]].itertuples(index=False, name=None)
    return [f"run {key} {what}" for key in keys]
