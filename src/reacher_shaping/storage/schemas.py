"""The schema of every table of the study: its columns and their types."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import pyarrow as pa

INTEGER, NUMBER, TEXT, FLAG = pa.int64(), pa.float64(), pa.string(), pa.bool_()


@dataclass(frozen=True)
class Table:
    """Columns of a table and their types. `optional` columns may hold missing values.

    With `measures`, further columns are allowed; they are numbers, missing where there is no value.
    """

    columns: Mapping[str, pa.DataType]
    optional: frozenset[str] = frozenset()
    measures: bool = False

    def schema(self, names: Sequence[str]) -> pa.Schema:
        """The arrow schema for a table with these column names. Raises ValueError where they do not fit."""
        missing = [name for name in self.columns if name not in names]
        unknown = [name for name in names if name not in self.columns]
        if missing:
            raise ValueError(f"column {', '.join(missing)} is missing")
        if unknown and not self.measures:
            raise ValueError(f"unknown column {', '.join(unknown)}")
        if len(set(names)) != len(names):
            raise ValueError("a column is there twice")
        return pa.schema(
            [
                pa.field(name, self.columns.get(name, NUMBER), nullable=name in unknown or name in self.optional)
                for name in names
            ]
        )


_CELL = {"protocol": TEXT, "variant": TEXT, "budget": INTEGER, "alpha0": NUMBER}
MEASURES = (
    "episode_return",
    "shaped_return",
    "episode_length",
    "success_rate",
    "final_distance",
    "action_std",
    "entropy",
    "approx_kl",
    "clip_fraction",
    "policy_loss",
    "value_loss",
    "explained_variance",
    "logged_return",
)
"""The measures of a training iteration."""
_EPISODE_NUMBERS = ("episode_return", "reward_distance", "reward_control", "min_distance", "final_distance")
PROGRESS = Table(
    {"seed": INTEGER, "iteration": INTEGER, "env_steps": INTEGER, **dict.fromkeys(MEASURES, NUMBER)},
    optional=frozenset(MEASURES),
)
EPISODES = Table(
    {
        "seed": INTEGER,
        "mode": TEXT,
        "episode": INTEGER,
        **dict.fromkeys(_EPISODE_NUMBERS, NUMBER),
        "first_hit_step": INTEGER,
        "success": FLAG,
        "final_success": FLAG,
        "share_within_radius": NUMBER,
    },
    optional=frozenset({"first_hit_step", *_EPISODE_NUMBERS}),
)
RUNS = Table({**_CELL, "seed": INTEGER, "episodes": INTEGER, "diverged": FLAG}, measures=True)
CELLS = Table({**_CELL, "seeds": INTEGER, "diverged": INTEGER, "interval": TEXT}, measures=True)
CORRELATION = Table(
    {"method": TEXT, "x": TEXT, "y": TEXT, "r": NUMBER, "ci_low": NUMBER, "ci_high": NUMBER, "n": INTEGER}
    | {"level": TEXT, "protocol": TEXT},
    optional=frozenset({"r", "ci_low", "ci_high"}),
)
CURVES = Table(
    {**_CELL, "iteration": INTEGER, "env_steps": INTEGER, "episode_return": NUMBER, "low": NUMBER, "high": NUMBER}
    | {"seeds": INTEGER},
    optional=frozenset({"episode_return", "low", "high"}),
)
CLAIMS = Table(
    {"id": TEXT, "claim": TEXT, "published": NUMBER, "measured": NUMBER, "ci_low": NUMBER, "ci_high": NUMBER}
    | {"test": TEXT, "verdict": TEXT},
    optional=frozenset({"published", "measured", "ci_low", "ci_high"}),
)
CLAIM_PARTS = Table(
    {"id": TEXT, "part": TEXT, "published": NUMBER, "measured": NUMBER, "ci_low": NUMBER, "ci_high": NUMBER}
    | {"seeds": INTEGER, "rule": TEXT, "verdict": TEXT},
    optional=frozenset({"published", "measured", "ci_low", "ci_high"}),
)
CONTROLLERS = Table({"protocol": TEXT, "controller": TEXT, "mode": TEXT, "episodes": INTEGER}, measures=True)
_LENGTH = {"seed": INTEGER, "mode": TEXT, "steps": INTEGER, "episodes": INTEGER}
LONG_EPISODES = Table(_LENGTH, measures=True)
ALL_LONG_EPISODES = Table({**_CELL, **_LENGTH}, measures=True)
LENGTHS = Table({**_CELL, "mode": TEXT, "steps": INTEGER, "seeds": INTEGER}, measures=True)
RADII = Table({**_CELL, "mode": TEXT, "radius": NUMBER, "seeds": INTEGER}, measures=True)
COMPARISONS = Table(
    {"family": TEXT, "metric": TEXT, **_CELL, "other_variant": TEXT, "other_budget": INTEGER, "other_alpha0": NUMBER}
    | {"seeds": INTEGER},
    measures=True,
)
PEERS = Table({"algorithm": TEXT, "seed": INTEGER, "budget": INTEGER}, measures=True)
EFFECTS = Table(
    {"variant": TEXT, "switch": TEXT, "setting": TEXT, "effect": TEXT, "metric": TEXT, "seeds": INTEGER}, measures=True
)
AGREEMENT = Table(
    {"algorithm": TEXT, "budget": INTEGER, "metric": TEXT, "our_seeds": INTEGER, "their_seeds": INTEGER}, measures=True
)
LOGS = Table({**_CELL, "seed": INTEGER}, measures=True)
TRIALS = Table({"trial": INTEGER}, measures=True)
VARIANCE = Table({**_CELL, "seeds": INTEGER}, measures=True)
POWER = Table({**_CELL, "seeds": INTEGER}, measures=True)
LOTTERY = Table({"statement": TEXT}, measures=True)
WINNERS = Table({"variant": TEXT, "budget": INTEGER, "alpha0": NUMBER, "share": NUMBER})
SPREAD = Table({"quantity": TEXT}, measures=True)
STUDY_TABLES = {
    "runs": RUNS,
    "cells": CELLS,
    "curves": CURVES,
    "logs": LOGS,
    "logged": CURVES,
    "comparisons": COMPARISONS,
    "correlation": CORRELATION,
    "controllers": CONTROLLERS,
    "effects": EFFECTS,
    "agreement": AGREEMENT,
}
"""The tables of a further study by the names of their files, see `outputs.table_files`."""
