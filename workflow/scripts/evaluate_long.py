"""Evaluate the policies of one seed block on episodes longer than those they were trained on."""

import json
from pathlib import Path

from job import logged

from reacher_shaping.evaluation.episode_lengths import EPISODES, evaluate_lengths
from reacher_shaping.evaluation.evaluate import Conditions
from reacher_shaping.settings.cell import Environment
from reacher_shaping.settings.parts import Evaluation
from reacher_shaping.storage import block_schemas
from reacher_shaping.storage.files import read_json, write_json, write_table
from reacher_shaping.storage.policy_format import read_policy
from reacher_shaping.storage.provenance import Record, merged_manifest, unchanged
from reacher_shaping.tasks.base import load_task
from reacher_shaping.training.policy import Policy

record = Record()
params, output = snakemake.params, snakemake.output
evaluation = Evaluation.model_validate_json(params.evaluation)
environment = Environment.model_validate_json(params.environment)

with logged(snakemake):
    trained = read_policy(unchanged(snakemake.input.policy, snakemake.input.training, json.loads(params.asked)))
    long = evaluate_lengths(
        Policy.from_weights(trained.weights, load_task(environment.task)).act,
        trained.seeds,
        Conditions(
            environment=environment,
            root_seed=params.root_seed,
            success_radius=evaluation.radius,
            episodes=EPISODES,
        ),
    )
    write_table(output.episodes, long, block_schemas.LONG_EPISODES)
    steps = int((long["steps"] * long["episodes"]).sum())
    files = [Path(output.episodes)]
    part = record.to_dict(files[0].parent, [Path(snakemake.input.policy)], files, steps, snakemake.threads)
    part = {"settings": json.loads(params.evaluation), "code": params.code, **part}
    write_json(output.manifest, merged_manifest(read_json(snakemake.input.training), part))
