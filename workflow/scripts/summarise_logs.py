"""What the logs of a study's protocols show of its runs."""

import json

import pandas as pd
from job import logged

from reacher_shaping.analysis import learning_curves, switch_effects
from reacher_shaping.storage import block_schemas, schemas
from reacher_shaping.storage.files import read_table, write_table
from reacher_shaping.storage.provenance import unchanged

given, params, output = snakemake.input, snakemake.params, snakemake.output

with logged(snakemake):
    blocks = zip(params.cells, given.progress, given.manifests, map(json.loads, params.asked), strict=True)
    parts = [read_table(unchanged(*file), block_schemas.PROGRESS).assign(**cell) for cell, *file in blocks]
    progress = pd.concat(parts, ignore_index=True)
    write_table(output.logs, switch_effects.logs_frame(progress), schemas.LOGS)
    logged_curves = learning_curves.curve_table(progress, column="logged_return")
    write_table(output.logged, logged_curves, schemas.CURVES)
