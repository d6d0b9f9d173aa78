"""What an experiment's policies do on longer episodes than those they were trained on."""

import json

import pandas as pd
from job import logged

from reacher_shaping.analysis.runs import length_cells
from reacher_shaping.storage import block_schemas, schemas
from reacher_shaping.storage.files import read_table, write_table
from reacher_shaping.storage.provenance import unchanged

given, params = snakemake.input, snakemake.params

with logged(snakemake):
    blocks = zip(params.cells, given.long_episodes, given.manifests, map(json.loads, params.asked), strict=True)
    parts = [read_table(unchanged(*file), block_schemas.LONG_EPISODES).assign(**cell) for cell, *file in blocks]
    write_table(snakemake.output.lengths, length_cells(pd.concat(parts, ignore_index=True)), schemas.LENGTHS)
