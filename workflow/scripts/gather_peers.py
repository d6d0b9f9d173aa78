"""Put the peers' runs into one table."""

import pandas as pd
from job import logged

from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_table, write_table

with logged(snakemake):
    runs = [read_table(path, schemas.PEERS) for path in snakemake.input]
    write_table(snakemake.output[0], pd.concat(runs, ignore_index=True), schemas.PEERS)
