"""What a table's schema is, and the schemas of a seed block's tables.

Those of the study-wide tables stand in `schemas`, so that a new one of them trains nothing again.
"""

from collections.abc import Mapping
from dataclasses import dataclass

INTEGER, NUMBER, TEXT, FLAG = "int64", "float64", "string", "bool"
"""Types of columns, by Arrow's names; nothing heavy is loaded, for the workflow reads the catalogue of tables."""


@dataclass(frozen=True)
class Table:
    """Columns of a table and their types. `optional` columns may hold missing values.

    With `measures`, further columns are allowed; they are numbers, missing where there is no value.
    """

    columns: Mapping[str, str]
    optional: frozenset[str] = frozenset()
    measures: bool = False


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
    "alpha",
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
LENGTH = {"seed": INTEGER, "mode": TEXT, "steps": INTEGER, "episodes": INTEGER}
LONG_EPISODES = Table(LENGTH, measures=True)
