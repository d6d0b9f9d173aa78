"""Evaluate the policies of one seed block on episodes longer than those they were trained on."""

import torch
from job import logged

from reacher_shaping import artifacts, schemas
from reacher_shaping.cell import Environment
from reacher_shaping.config import Evaluation
from reacher_shaping.long_episodes import evaluate_lengths
from reacher_shaping.policy import Policy
from reacher_shaping.provenance import unchanged

params = snakemake.params
environment = Environment.model_validate_json(params.environment)

with logged(snakemake.log[0]):
    torch.set_num_threads(snakemake.threads)
    trained = artifacts.read_policy(unchanged(snakemake.input.policy))
    long = evaluate_lengths(
        Policy.from_weights(trained.weights).act,
        trained.seeds,
        mode="stochastic",
        radius=Evaluation.model_validate_json(params.evaluation).radius,
        control_weight=environment.control_weight,
        clip_actions=environment.clip_actions,
        root_seed=params.root_seed,
    )
    artifacts.write_table(snakemake.output[0], long, schemas.LONG_EPISODES)
