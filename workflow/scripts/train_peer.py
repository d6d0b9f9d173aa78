"""Train and evaluate one run of another algorithm."""

import json
from pathlib import Path

from job import logged

from reacher_shaping import artifacts, peers, schemas
from reacher_shaping.cell import Protocol
from reacher_shaping.config import Evaluation
from reacher_shaping.provenance import Record, reached_files

record = Record()
params, wildcards, output = snakemake.params, snakemake.wildcards, snakemake.output

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
    artifacts.write_table(output.run, run, schemas.PEERS)
    path = Path(output.run)
    told = record.to_dict(path.parent, reached_files(__file__), [path], params.budget, snakemake.threads)
    settings = {"protocol": json.loads(params.protocol), "evaluation": json.loads(params.evaluation)}
    who = {"algorithm": wildcards.algorithm, "seeds": [int(wildcards.seed)], "settings": settings}
    artifacts.write_json(output.manifest, {**who, "code": params.code, **told})
