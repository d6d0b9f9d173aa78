"""What an experiment's policies do on longer episodes than those they were trained on."""

import pandas as pd
from job import logged

from reacher_shaping.analysis.runs import length_cells
from reacher_shaping.storage import block_schemas, schemas
from reacher_shaping.storage.files import read_table, write_table

given, params = snakemake.input, snakemake.params

with logged(snakemake.log[0]):
    blocks = zip(params.cells, given.long_episodes, strict=True)
    parts = [read_table(path, block_schemas.LONG_EPISODES).assign(**cell) for cell, path in blocks]
    write_table(snakemake.output.lengths, length_cells(pd.concat(parts, ignore_index=True)), schemas.LENGTHS)
