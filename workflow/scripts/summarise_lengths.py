"""What a study's policies do on other lengths of episodes than those they were trained on."""

import json

import pandas as pd
from job import logged

from reacher_shaping.analysis.runs import length_cells
from reacher_shaping.labels import KEY
from reacher_shaping.storage import block_schemas, schemas
from reacher_shaping.storage.files import read_table, write_table
from reacher_shaping.storage.provenance import unchanged

given, params, output = snakemake.input, snakemake.params, snakemake.output

with logged(snakemake):
    blocks = zip(params.cells, given.long_episodes, given.manifests, map(json.loads, params.asked), strict=True)
    parts = [
        read_table(unchanged(*file), block_schemas.LONG_EPISODES).assign(**{name: cell[name] for name in KEY})
        for cell, *file in blocks
    ]
    long = pd.concat(parts, ignore_index=True)
    write_table(output.long_episodes, long, schemas.ALL_LONG_EPISODES)
    write_table(output.lengths, length_cells(long), schemas.LENGTHS)
