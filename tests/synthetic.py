"""Made-up tables with the columns of the study's, for tests of what is drawn and written from them."""

from pathlib import Path

import numpy as np
import pandas as pd
import yaml

from reacher_shaping.labels import DESIGN
from reacher_shaping.paper_variants import VARIANTS
from reacher_shaping.report import paper_tables

PUBLISHED = Path(__file__).parents[1] / "report" / "published"

MAIN = ("none", "l2", "l2sq", "decay200k", "decay300k", "decay500k")
L2SQ = ("decay200k_l2sq", "decay300k_l2sq", "decay500k_l2sq")
CELL = ["protocol", "variant", "budget", "alpha0"]
PAPER_GRID = [
    *[("paper", variant, budget, 1.0) for variant in MAIN for budget in (500_000, 1_000_000)],
    *[("paper", variant, 500_000, 0.5) for variant in MAIN[1:]],
    *[("paper", variant, budget, 0.5) for variant in L2SQ for budget in (500_000, 1_000_000)],
]
TOY_GRID = [("paper", variant, 4096, 1.0) for variant in ("none", "l2", "decay200k")]
MEASURES = (
    "success_rate", "mean_return", "final_success_rate", "final_distance", "min_distance",
    "reward_distance", "reward_control", "first_hit_step", "share_within_radius",
)  # fmt: skip
CURVE = ("peak_return", "final_return", "drop_from_peak", "roughness", "area_under_curve", "steps_to_threshold")


def design(variant, **changes):
    """What the cells of one of the paper's variants are for, in the columns of the tables."""
    return dict(zip(DESIGN, ("main", *VARIANTS[variant]), strict=True)) | changes


def runs(grid, seeds=10):
    """A row per run, as `runs.parquet` has it."""
    generator = np.random.default_rng(1)
    rows = []
    for key in grid:
        for seed in range(seeds):
            success = float(np.clip(generator.normal(0.28, 0.07), 0, 1))
            distance, control = -generator.uniform(5, 8), -generator.uniform(2, 6)
            row = dict(zip(CELL, key, strict=True), seed=seed, episodes=1000, success_rate=success)
            row |= {"mean_return": distance + control, "reward_distance": distance, "reward_control": control}
            row |= {"final_success_rate": success / 3, "final_distance": generator.uniform(0.02, 0.1)}
            row |= {"min_distance": generator.uniform(0.01, 0.03), "first_hit_step": generator.uniform(10, 30)}
            row |= {"share_within_radius": success / 10}
            row |= {f"deterministic_{name}": row[name] for name in MEASURES}
            row |= {"peak_return": -9.0, "peak_iteration": 200, "final_return": -10.0, "diverged": False}
            row |= {"drop_from_peak": 1.0 + success, "roughness": success / 5, "area_under_curve": -12.0 + success}
            row |= {"steps_to_threshold": 2048.0 * (50 + seed)}
            rows.append(row | design(key[1]))
    return pd.DataFrame(rows)


def cells(grid, seeds=10):
    """A row per cell, as `cells.parquet` has it."""
    return summary(runs(grid, seeds))


def summary(table):
    """The cells of a table of runs."""
    names = [*MEASURES, *[f"deterministic_{name}" for name in MEASURES], *CURVE]
    rows = []
    for key, part in table.groupby(CELL, sort=False):
        row = dict(zip(CELL, key, strict=True), seeds=len(part), diverged=int(part["diverged"].sum()))
        row["interval"] = "95 % t over seeds"
        columns = {}
        for name in names:
            mean, spread = part[name].mean(), 2 * part[name].std(ddof=0) / np.sqrt(len(part))
            columns |= {name: mean, f"{name}_iqm": mean, f"{name}_low": mean - spread, f"{name}_high": mean + spread}
        rows.append(row | columns | {name: part[name].iloc[0] for name in DESIGN})
    return pd.DataFrame(rows)


def diverge(table, variant="l2", seed=1):
    """The runs with those of one variant and seed diverged: no return and no curve measures, no success either."""
    table = table.copy()
    lost = (table["variant"] == variant) & (table["seed"] == seed)
    numbers = ["mean_return", "final_distance", "reward_distance", "reward_control", "first_hit_step", *CURVE]
    table.loc[lost, numbers] = np.nan
    table.loc[lost, ["success_rate", "final_success_rate"]] = 0.0
    table.loc[lost, "diverged"] = True
    return table


def peers(seeds=3):
    """A row per run of another algorithm, as `peers.parquet` has it."""
    budgets = {"td3": 100_000, "ppo": 500_000, "sac": 100_000}
    rows = []
    for number, (name, budget) in enumerate(budgets.items()):
        for seed in range(seeds):
            row = {"algorithm": name, "seed": seed, "budget": budget}
            values = dict.fromkeys(MEASURES, 0.1 * (number + 1) + 0.01 * seed)
            values |= {"success_rate": 0.3 * number + 0.1 * seed, "mean_return": -3.0 - number - seed}
            rows.append(row | values | {f"deterministic_{measure}": value for measure, value in values.items()})
    return pd.DataFrame(rows)


def over(grid, seeds, column, values):
    """The cells repeated over the values of a further column, in one mode: radii or episode lengths."""
    parts = [cells(grid, seeds).assign(**{column: value}, mode="stochastic") for value in values]
    names = [name for name in MEASURES if name.startswith(("success", "final"))]
    columns = [f"{name}{end}" for name in names for end in ("", "_iqm", "_low", "_high")]
    return pd.concat(parts, ignore_index=True)[[*CELL, "mode", column, "seeds", *columns]]


def progress(grid, seeds=10):
    """All progress tables in one, with the cell's key added."""
    generator = np.random.default_rng(2)
    parts = []
    for key in grid:
        iteration = np.arange(1, -(-key[2] // 2048) + 1)
        for seed in range(seeds):
            noise = generator.normal(0, 1.5, iteration.size)
            curve = -10 - 45 * np.exp(-iteration / 30) - generator.gamma(2.0, 1.0) + noise
            rows = {"seed": seed, "iteration": iteration, "env_steps": 2048 * iteration, "episode_return": curve}
            parts.append(pd.DataFrame(dict(zip(CELL, key, strict=True)) | rows | design(key[1])))
    return pd.concat(parts, ignore_index=True)


def correlation(r=(0.1, 0.91, 0.03, 0.37, 0.3, -0.2)):
    """Pearson and Spearman coefficients of every pair, as `correlation.csv` has them."""
    names = ("alpha0", "success_rate", "mean_return", "budget")
    pairs = [(x, y) for i, x in enumerate(names) for y in names[i + 1 :]]
    rows = [
        {"method": method, "x": x, "y": y, "r": value, "ci_low": value - 0.2, "ci_high": value + 0.05, "n": 17,
         "level": level, "protocol": "paper"}
        for method in ("pearson", "spearman")
        for level in ("cells", "runs")
        for (x, y), value in zip(pairs, r, strict=True)
    ]  # fmt: skip
    return pd.DataFrame(rows)


def claims():
    """One claim of each verdict, as `claims.csv` has them."""
    rows = [
        ("C1", "Shaping improves success over none", 0.051, 0.01, -0.02, 0.04, "inconclusive"),
        ("C3", "Decay beats constant shaping", -0.02, -0.06, -0.10, -0.02, "not reproduced"),
        ("C17", "Shaping speeds learning up", np.nan, -15000.0, -60000.0, 30000.0, "inconclusive"),
        ("C12", "L2 gains from a longer budget, L2² does not", 0.03, 0.05, 0.02, 0.08, "reproduced"),
        ("C18", "PPO often fails to reach the target", np.nan, 0.28, 0.24, 0.32, "reproduced"),
        ("C19", "SAC and TD3 do better than PPO", np.nan, np.nan, np.nan, np.nan, "untestable"),
    ]
    frame = pd.DataFrame(rows, columns=["id", "claim", "published", "measured", "ci_low", "ci_high", "verdict"])
    frame.insert(6, "test", "paired difference over seeds")
    frame = frame.assign(
        dated="2026-11-25", replication=0.93, interval_verdict=frame["verdict"], seeds_to_decide=np.nan
    )
    frame.loc[frame["verdict"] == "inconclusive", "seeds_to_decide"] = 45.0
    frame = frame.assign(family_verdict=frame["verdict"], power=0.85, refuted_if_true=0.01, published_holds=1.0)
    return frame.assign(first_dated="2026-11-22", first_verdict=frame["verdict"], second_verdict=frame["verdict"])


def ledger():
    """The ledger of the claims, as it stands."""
    return yaml.safe_load((PUBLISHED.parent / "claims.yaml").read_text(encoding="utf-8"))


def claim_parts():
    """An estimate for each rule of the newest tests, as `claim_parts.csv` has them."""
    rows = []
    for claim in ledger():
        for number, name in enumerate(claim["tests"][-1]["rules"]):
            row = {"id": claim["id"], "part": name, "published": 0.05, "measured": 0.01 * number - 0.02}
            row |= {"ci_low": row["measured"] - 0.03, "ci_high": row["measured"] + 0.03, "seeds": 10, "rule": "above 0"}
            rows.append(row | {"verdict": "inconclusive", "dated": "2026-11-25", "current": True})
    return pd.DataFrame(rows)


def controllers():
    """Policies that need no learning."""
    names = ("zero action", "uniform random", "untrained network", "inverse kinematics + PD")
    return pd.DataFrame(
        {"controller": names, "success_rate": (0.002, 0.17, 0.2, 1.0), "mean_return": (-11.8, -42.8, -109.0, -3.7)}
    )


def published():
    """The paper's tables under our cell keys."""
    return paper_tables.published_cells(*(pd.read_csv(PUBLISHED / name) for name in ("table2.csv", "table3.csv")))
