"""What a report is made of, from made-up tables, for the tests of the page."""

from pathlib import Path

import numpy as np
import pandas as pd
import synthetic
from matplotlib.figure import Figure

from reacher_shaping.analysis import comparisons, single_seed_studies
from reacher_shaping.analysis.scores import scores_frame
from reacher_shaping.evaluation import shown_policies
from reacher_shaping.evaluation.evaluate import Conditions
from reacher_shaping.figures.style import save
from reacher_shaping.report import html, loader
from reacher_shaping.settings.study import load_study
from reacher_shaping.storage.files import write_json
from reacher_shaping.storage.policy_format import weights_checksum, write_policy

ROOT = Path(__file__).parents[1]

MANIFEST = {
    "git": {"commit": "0123456789abcdef0123", "dirty": True},
    "machine": {"cpu": "A processor", "cores": 2, "system": "Linux"},
    "threads": 1,
    "versions": {"python": "3.11.7", "torch": "2.13.0"},
    "env_steps": 5_000_000,
    "wall_seconds": 900.0,
    "cpu_seconds": 890.0,
    "env_steps_per_second": 5555.6,
}


KEY = ["protocol", "variant", "budget", "alpha0"]


def curves(grid):
    """Three iterations of every cell, of which one is shown: its return is minus its number in the grid."""
    return pd.DataFrame(
        [
            dict(
                zip(KEY, cell, strict=True),
                iteration=at,
                env_steps=2048 * at,
                episode_return=-n,
                low=-n - 1,
                high=-n + 1,
            )
            for n, cell in enumerate(grid)
            for at in (1, 2, 3)
        ]
    )


def seed_curves(grid, seeds):
    """Three iterations of every run: its return is minus its seed."""
    rows = [
        dict(zip(KEY, cell, strict=True), seed=seed, iteration=at, env_steps=2048 * at, episode_return=-float(seed))
        for cell in grid
        for seed in range(seeds)
        for at in (1, 4, 7)
    ]
    return pd.DataFrame(rows)


def radii(grid):
    """Success of every cell at three radii, the radius in units of 0.05 m; a tenth of it at the last step."""
    made = [
        dict(zip(KEY, cell, strict=True), mode="stochastic", radius=radius, success_rate=radius / 0.05)
        for cell in grid
        for radius in (0.01, 0.02, 0.03)
    ]
    frame = pd.DataFrame(made).assign(final_success_rate=lambda rows: rows["success_rate"] / 10)
    for name in ("success_rate", "final_success_rate"):
        frame[f"{name}_low"], frame[f"{name}_high"] = frame[name] - 0.05, frame[name] + 0.05
    return frame


def make(folder, study, grid, seeds, **changes):
    cells = synthetic.cells(grid, seeds)
    sizes = {
        "figure_1": (2, 1),
        "figure_2": (1, 2),
        "lottery": (1, 1),
        "success_by_radius": (2, 1),
        "forest": (2, 2),
        "peers": (3, 1),
    }
    figures = {name: Figure(figsize=size) for name, size in sizes.items()}
    paths = {name: save(figure, folder / "figures" / name, ("svg", "pdf"))[0] for name, figure in figures.items()}
    (folder / "media").mkdir()
    for key in grid:
        for kind in ("gif", "mp4"):
            name = f"{key[0]}-{key[1]}-{key[2]}-alpha{key[3]:g}.{kind}"
            (folder / "media" / name).write_bytes(kind.encode() + bytes(range(200)))
    runs = synthetic.runs(grid, seeds)
    studies = single_seed_studies.single_seed_studies(runs, np.random.default_rng(0), 50)
    tables = {
        "cells": cells, "runs": runs, "correlation": synthetic.correlation(), "controllers": synthetic.controllers(),
        "power": comparisons.power_frame(runs, synthetic.published()), "variance": comparisons.variance_frame(runs),
        "comparisons": comparisons.comparison_frame(runs), "peers": synthetic.peers(),
        "winners": single_seed_studies.winners_frame(studies), "spread": single_seed_studies.spread_frame(studies),
        "claims": synthetic.claims(), "claim_parts": synthetic.claim_parts(), "scores": scores_frame(runs),
        "curves": curves(grid), "seed_curves": seed_curves(grid, seeds), "radii": radii(grid),
    }  # fmt: skip
    kept = changes.pop("only", tables)
    tables = {name: table for name, table in tables.items() if name in kept}
    published = synthetic.published()
    (folder / "policies").mkdir()
    cell = load_study(ROOT / "config.yaml").cells[0]
    start = shown_policies.untrained(cell, 0)
    write_policy(folder / "policies" / "untrained.pt", [0], start.weights(), {"cell": cell.settings()})
    acts = {"untrained": start.act, "controller": shown_policies.controller(cell)[0]}
    radius = study["evaluation"]["radius"]
    conditions = Conditions(
        environment=cell.protocol.environment, root_seed=cell.root_seed, success_radius=radius, episodes=2
    )
    shown = {name: shown_policies.measured(act, conditions) for name, act in acts.items()}
    shown["untrained"] |= {"cell": cell.name, "seed": 0, "weights": weights_checksum(start.weights())}
    shown["controller"]["gains"] = shown_policies.controller(cell)[1]
    write_json(folder / "policies" / "policies.json", shown)
    files = loader.Study(tables, {}, published, published, pd.DataFrame(), synthetic.ledger())
    given = {
        "settings": study, "study": files, "figures": paths,
        "media": sorted((folder / "media").iterdir()), "manifests": [MANIFEST] * 3,
        "policies": folder / "policies" / "policies.json",
        "notebooks": [folder / "results" / "notebooks" / "story.html"], "settings_hash": "ab" * 32,
    }  # fmt: skip
    return html.Inputs(**(given | changes))
