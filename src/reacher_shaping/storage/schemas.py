"""The schemas of the study-wide tables: their columns and types."""

from reacher_shaping.storage.block_schemas import FLAG, INTEGER, LENGTH, NUMBER, TEXT, Table

_DESIGN = {"study": TEXT, "group": TEXT, "potential": TEXT, "schedule": TEXT, "horizon": NUMBER}
_HORIZON = frozenset({"horizon"})
_CELL = {"protocol": TEXT, "variant": TEXT, "budget": INTEGER, "alpha0": NUMBER}
RUNS = Table({**_CELL, "seed": INTEGER, "episodes": INTEGER, "diverged": FLAG, **_DESIGN}, _HORIZON, measures=True)
CELLS = Table({**_CELL, "seeds": INTEGER, "diverged": INTEGER, "interval": TEXT, **_DESIGN}, _HORIZON, measures=True)
CORRELATION = Table(
    {"method": TEXT, "x": TEXT, "y": TEXT, "r": NUMBER, "ci_low": NUMBER, "ci_high": NUMBER, "n": INTEGER}
    | {"level": TEXT, "protocol": TEXT},
    optional=frozenset({"r", "ci_low", "ci_high"}),
)
CURVES = Table(
    {**_CELL, "iteration": INTEGER, "env_steps": INTEGER, "episode_return": NUMBER, "low": NUMBER, "high": NUMBER}
    | {"seeds": INTEGER, **_DESIGN},
    optional=frozenset({"episode_return", "low", "high"}) | _HORIZON,
)
SEED_CURVES = Table(
    {**_CELL, "seed": INTEGER, "iteration": INTEGER, "env_steps": INTEGER, "episode_return": NUMBER},
    optional=frozenset({"episode_return"}),
)
_NUMBERS = {"published", "measured", "ci_low", "ci_high", "replication", "power", "refuted_if_true"}
_WORTH = {"dated": TEXT, "replication": NUMBER, "interval_verdict": TEXT, "seeds_to_decide": NUMBER}
_WORTH |= {"family_verdict": TEXT, "power": NUMBER, "refuted_if_true": NUMBER, "published_holds": NUMBER}
CLAIMS = Table(
    {"id": TEXT, "claim": TEXT, "published": NUMBER, "measured": NUMBER, "ci_low": NUMBER, "ci_high": NUMBER}
    | {"test": TEXT, "verdict": TEXT, **_WORTH, "first_dated": TEXT, "first_verdict": TEXT}
    | {"second_verdict": TEXT},
    optional=frozenset(_NUMBERS | {"seeds_to_decide", "published_holds", "second_verdict"}),
)
CLAIM_PARTS = Table(
    {"id": TEXT, "part": TEXT, "published": NUMBER, "measured": NUMBER, "ci_low": NUMBER, "ci_high": NUMBER}
    | {"seeds": INTEGER, "rule": TEXT, "verdict": TEXT, "dated": TEXT, "current": FLAG, "family_low": NUMBER}
    | {"family_high": NUMBER, "family_verdict": TEXT, "replication": NUMBER, "power": NUMBER, "refuted_if_true": NUMBER}
    | dict.fromkeys(("holds_above", "holds_below", "refuted_below", "refuted_above"), NUMBER),
    optional=frozenset(_NUMBERS | {"family_low", "family_high"}),
)
FAMILY_ERROR = Table({"reading": TEXT, "level": NUMBER, "estimates": INTEGER, "worst": NUMBER})
SENSITIVITY = Table(
    {"id": TEXT, "choice": TEXT, "measured": NUMBER, "ci_low": NUMBER, "ci_high": NUMBER, "verdict": TEXT},
    optional=frozenset({"measured", "ci_low", "ci_high"}),
)
CONTROLLERS = Table({"protocol": TEXT, "controller": TEXT, "mode": TEXT, "episodes": INTEGER}, measures=True)
ALL_LONG_EPISODES = Table({**_CELL, **LENGTH}, measures=True)
LENGTHS = Table({**_CELL, "mode": TEXT, "steps": INTEGER, "seeds": INTEGER}, measures=True)
RUN_RADII = Table({**_CELL, "seed": INTEGER, "mode": TEXT, "radius": NUMBER}, measures=True)
RADII = Table({**_CELL, "mode": TEXT, "radius": NUMBER, "seeds": INTEGER}, measures=True)
COMPARISONS = Table(
    {"family": TEXT, "metric": TEXT, **_CELL, "other_variant": TEXT, "other_budget": INTEGER, "other_alpha0": NUMBER}
    | {"seeds": INTEGER, "group": TEXT},
    measures=True,
)
PEERS = Table({"algorithm": TEXT, "seed": INTEGER, "budget": INTEGER}, measures=True)
EFFECTS = Table(
    {"variant": TEXT, "switch": TEXT, "setting": TEXT, "effect": TEXT, "metric": TEXT, "seeds": INTEGER}, measures=True
)
HYPOTHESES = Table({"id": TEXT, "claim": TEXT, "a": TEXT, "b": TEXT, "predicts": TEXT, "verdict": TEXT}, measures=True)
TAKEOFF = Table({**_CELL, "seed": INTEGER, "iteration": INTEGER, "env_steps": INTEGER, "success_rate": NUMBER})
TARGETS = Table({**_CELL, "target_x": NUMBER, "target_y": NUMBER, "episodes": INTEGER, "final_success_rate": NUMBER})
AGREEMENT = Table(
    {"algorithm": TEXT, "budget": INTEGER, "metric": TEXT, "our_seeds": INTEGER, "their_seeds": INTEGER}, measures=True
)
LOGS = Table({**_CELL, "seed": INTEGER}, measures=True)
TRIALS = Table({"trial": INTEGER, "variant": TEXT}, measures=True)
VARIANCE = Table({**_CELL, "seeds": INTEGER}, measures=True)
POWER = Table({**_CELL, "seeds": INTEGER}, measures=True)
LOTTERY = Table({"statement": TEXT}, measures=True)
WINNERS = Table({"variant": TEXT, "budget": INTEGER, "alpha0": NUMBER, "share": NUMBER})
SPREAD = Table({"quantity": TEXT}, measures=True)
SCORES = Table({**_CELL, "metric": TEXT, "seeds": INTEGER}, measures=True)
PROFILES = Table(
    {"protocol": TEXT, "kind": TEXT, "budget": INTEGER, "threshold": NUMBER, "seeds": INTEGER}, measures=True
)
