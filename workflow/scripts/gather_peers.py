"""Put the peers' runs into one table."""

import json

import pandas as pd
from job import logged

from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_table, write_table
from reacher_shaping.storage.provenance import unchanged

with logged(snakemake):
    files = zip(snakemake.input, map(json.loads, snakemake.params.asked), strict=True)
    runs = [read_table(unchanged(path, asked=asked), schemas.PEERS) for path, asked in files]
    write_table(snakemake.output[0], pd.concat(runs, ignore_index=True), schemas.PEERS)
