"""Gather the policies that the report's page shows: a file each, and what they did in one more."""

import json
from pathlib import Path
from typing import Any

from job import logged

from reacher_shaping.evaluation import shown_policies
from reacher_shaping.evaluation.evaluate import Conditions, Mode
from reacher_shaping.settings.cell import Cell
from reacher_shaping.storage.files import read_json, write_json
from reacher_shaping.storage.policy_format import read_policy, weights_checksum, write_policy
from reacher_shaping.storage.provenance import unchanged
from reacher_shaping.tasks.base import load_task
from reacher_shaping.training.policy import Policy

params = snakemake.params
folder = Path(snakemake.output.summary).parent


def conditions(cell: Cell, mode: Mode) -> Conditions:
    return Conditions(
        environment=cell.protocol.environment,
        root_seed=cell.root_seed,
        success_radius=params.radius,
        episodes=params.episodes,
        mode=mode,
    )


def kept(
    name: str, cell: Cell, seed: int, weights: dict[str, Any], settings: dict[str, Any], provenance: dict[str, Any]
) -> dict[str, Any]:
    """Write one run's policy; return what the summary says of it."""
    write_policy(folder / f"{name}.pt", [seed], weights, settings)
    act = Policy.from_weights(weights, load_task(cell.protocol.environment.task)).act
    told = {"cell": cell.name, "seed": seed, "weights": weights_checksum(weights), **provenance}
    return told | shown_policies.measured(act, conditions(cell, "stochastic"))


with logged(snakemake) as say:
    shown: dict[str, Any] = {}
    for name, policy, training, asked in zip(
        params.names, snakemake.input.policies, snakemake.input.trainings, params.asked, strict=True
    ):
        trained = read_policy(unchanged(policy, training, json.loads(asked)))
        cell = Cell.model_validate_json(json.dumps(trained.settings["cell"]))
        seed, record = trained.seeds[0], read_json(training)
        if not shown:
            reference = cell  # the untrained network and the controller are those of the first
            start = shown_policies.untrained(cell, seed).weights()
            shown["untrained"] = kept("untrained", cell, seed, start, trained.settings, {})
        weights = {key: tensor[:1] for key, tensor in trained.weights.items()}
        provenance = {"git": record["git"], "code": record["code"]}
        shown[name] = kept(name, cell, seed, weights, trained.settings, provenance)
        say(f"{name}: seed {seed} of {cell.name}")
    if shown:
        act, numbers = shown_policies.controller(reference)
        told = shown_policies.measured(act, conditions(reference, "deterministic"))
        shown["controller"] = {"gains": numbers} | told
    write_json(snakemake.output.summary, shown)
