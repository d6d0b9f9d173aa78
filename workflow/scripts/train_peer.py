"""Train and evaluate one run of another algorithm."""

import json
from pathlib import Path

from job import logged

from reacher_shaping.jobs import sb3_baselines
from reacher_shaping.settings.cell import Protocol
from reacher_shaping.settings.parts import Evaluation
from reacher_shaping.storage import schemas
from reacher_shaping.storage.code_hash import reached_files
from reacher_shaping.storage.files import write_json, write_table
from reacher_shaping.storage.provenance import Record

record = Record()
params, wildcards, output = snakemake.params, snakemake.wildcards, snakemake.output
settings = json.loads(params.settings)

with logged(snakemake) as say:
    run = sb3_baselines.peer_run(
        wildcards.algorithm,
        int(wildcards.seed),
        params.budget,
        Protocol.model_validate(settings["protocol"]),
        Evaluation.model_validate(settings["evaluation"]),
        settings["root_seed"],
        say,
    )
    write_table(output.run, run, schemas.PEERS)
    path = Path(output.run)
    told = record.to_dict(path.parent, reached_files(__file__), [path], params.budget, snakemake.threads)
    who = {"algorithm": wildcards.algorithm, "seeds": [int(wildcards.seed)], "settings": settings}
    write_json(output.manifest, {**who, "code": params.code, **told})
