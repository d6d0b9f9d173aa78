"""Evaluate the policies of one seed block on episodes longer than those they were trained on."""

from job import logged

from reacher_shaping.evaluation.episode_lengths import evaluate_lengths
from reacher_shaping.settings.cell import Environment
from reacher_shaping.settings.parts import Evaluation
from reacher_shaping.storage import block_schemas
from reacher_shaping.storage.files import write_table
from reacher_shaping.storage.policy_format import read_policy
from reacher_shaping.storage.provenance import unchanged
from reacher_shaping.tasks.base import load_task
from reacher_shaping.training.policy import Policy

params = snakemake.params
environment = Environment.model_validate_json(params.environment)

with logged(snakemake.log[0]):
    trained = read_policy(unchanged(snakemake.input.policy, snakemake.input.training))
    long = evaluate_lengths(
        Policy.from_weights(trained.weights, load_task(environment.task)).act,
        trained.seeds,
        mode="stochastic",
        radius=Evaluation.model_validate_json(params.evaluation).radius,
        environment=environment,
        root_seed=params.root_seed,
    )
    write_table(snakemake.output[0], long, block_schemas.LONG_EPISODES)
