"""Evaluate the policies of one seed block, stochastic and deterministic, on the same resets."""

import json
from dataclasses import replace
from pathlib import Path

import pandas as pd
from job import logged

from reacher_shaping.evaluation.evaluate import Conditions, Mode, evaluate
from reacher_shaping.settings.cell import Environment
from reacher_shaping.settings.parts import Evaluation
from reacher_shaping.storage import block_schemas
from reacher_shaping.storage.files import read_json, write_json, write_table
from reacher_shaping.storage.policy_format import read_policy
from reacher_shaping.storage.provenance import Record, merged_manifest, unchanged
from reacher_shaping.tasks.base import load_task
from reacher_shaping.training.policy import Policy

record = Record()
params, block = snakemake.params, Path(snakemake.output.episodes).parent
evaluation = Evaluation.model_validate_json(params.evaluation)
environment = Environment.model_validate_json(params.environment)

with logged(snakemake):
    trained = read_policy(unchanged(snakemake.input.policy, snakemake.input.training, json.loads(params.asked)))
    policy = Policy.from_weights(trained.weights, load_task(environment.task))
    conditions = Conditions(
        environment=environment,
        root_seed=params.root_seed,
        success_radius=evaluation.radius,
        episodes=evaluation.episodes,
    )
    modes: tuple[Mode, ...] = ("stochastic", "deterministic")
    frames = [evaluate(policy.act, trained.seeds, replace(conditions, mode=mode)) for mode in modes]
    episodes = pd.concat(frames, ignore_index=True)
    write_table(snakemake.output.episodes, episodes, block_schemas.EPISODES)
    files = [Path(snakemake.output.episodes)]
    part = record.to_dict(
        block,
        [Path(snakemake.input.policy)],
        files,
        load_task(environment.task).episode_steps * len(episodes),
        snakemake.threads,
    )
    part = {"settings": json.loads(params.evaluation), "code": params.code, **part}
    write_json(snakemake.output.manifest, merged_manifest(read_json(snakemake.input.training), part))
