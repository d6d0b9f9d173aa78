"""Train and evaluate one run of another algorithm."""

from job import logged

from reacher_shaping import artifacts, peers
from reacher_shaping.cell import Protocol
from reacher_shaping.config import Evaluation

params, wildcards = snakemake.params, snakemake.wildcards

with logged(snakemake.log[0]) as say:
    run = peers.peer_run(
        wildcards.algorithm,
        int(wildcards.seed),
        params.budget,
        Protocol.model_validate_json(params.protocol),
        Evaluation.model_validate_json(params.evaluation),
        params.root_seed,
        say,
    )
    artifacts.write_table(snakemake.output[0], run, artifacts.PEERS)
