"""Made-up runs of two protocols and the switches between them, with known effects."""

import numpy as np
import pandas as pd
import synthetic

from reacher_shaping.analysis import comparisons, correlation, switch_effects
from reacher_shaping.analysis.baselines import AGREEMENT_METRICS
from reacher_shaping.settings.cell import Protocol
from reacher_shaping.settings.parts import Switches

SWITCHES = Switches(
    start="paper", end="late", settings={"a": ("ppo.epochs",), "b": ("ppo.discount",)}, variants=("none",), budget=4096
)

PROTOCOLS = {
    "paper": Protocol(name="paper"),
    "late": Protocol.model_validate(
        {"name": "late", "environment": {"control_weight": 1.0}, "ppo": {"epochs": 5, "discount": 0.5}}
    ),
}

PROTOCOLS |= {
    name: PROTOCOLS["paper"].model_copy(update={"name": name})
    for name in ("paper_with_a", "paper_with_b", "late_without_a", "late_without_b")
}

LOGS = pd.DataFrame(
    [{"run": "none_seed0", "protocol": "released", "variant": "none", "budget": 500_000, "peak_return": -38.6,
      "peak_iteration": 33, "final_return": -87.2, "std_1": 0.4, "std_2": 0.54}]
)  # fmt: skip
"""One row of the published training logs."""

NOISE = np.array([-0.02, 0.01, 0.0, 0.03, -0.01, 0.02])


def runs(means, budget=4096, variant="none"):
    """Runs whose success is each protocol's mean plus the seed's own noise, common to all protocols."""
    rows = []
    for protocol, mean in means.items():
        for seed, noise in enumerate(NOISE):
            row = {"protocol": protocol, "variant": variant, "budget": budget, "alpha0": 1.0, "seed": seed}
            row |= {"success_rate": mean + noise, "final_success_rate": mean / 2, "final_distance": 0.1 - mean / 10}
            rows.append(row | {"reward_distance": -10.0, "reward_control": -2.0 - seed})
    return pd.DataFrame(rows)


MEANS = {
    "paper": 0.30, "paper_with_a": 0.35, "paper_with_b": 0.28,
    "late": 0.60, "late_without_a": 0.40, "late_without_b": 0.50,
}  # fmt: skip


def labelled_runs():
    grid = [("released", variant, budget, 1.0) for variant in ("none", "l2") for budget in (500_000, 1_000_000)]
    grid += [("late", variant, 500_000, 0.5) for variant in ("none", "l2", "l2sq", "decay200k_l2sq")]
    table = synthetic.runs(grid, 3)
    late = table["protocol"] == "late"
    table.loc[late, "mean_return"] = -500.0 - 10 * table.loc[late, "seed"]
    return table


def peers(shift=0.0, seeds=5):
    """Runs of a peer that are ours, or ours moved."""
    table = synthetic.runs([("standard", "none", 500_000, 1.0)], seeds)
    table["success_rate"] += shift
    return table.assign(algorithm="ppo")[["algorithm", "seed", "budget", *AGREEMENT_METRICS]]


def effects() -> pd.DataFrame:
    """The effects of the switches over runs whose means are `MEANS`."""
    return switch_effects.effects_frame(runs(MEANS), SWITCHES, PROTOCOLS)


def released() -> dict[str, pd.DataFrame]:
    """The tables of a study as the released code computes it."""
    labelled = labelled_runs().replace({"protocol": {"late": "released_late"}})
    keys = labelled[["protocol", "variant", "budget", "alpha0", "seed"]]
    numbers = {"peak_return": -40.0 - labelled["seed"], "peak_iteration": 30.0 + labelled["seed"]}
    logs = keys.assign(**numbers, final_return=-90.0, action_std=0.45)
    return {
        "runs": labelled,
        "cells": synthetic.summary(labelled),
        "logs": logs,
        "comparisons": comparisons.comparison_frame(labelled, (*comparisons.METRICS, *comparisons.SPEED)),
        "correlation": correlation.over_protocols(labelled, synthetic.published(), "released"),
    }
