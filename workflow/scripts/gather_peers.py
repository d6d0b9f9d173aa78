"""Put the peers' runs into one table."""

import pandas as pd
from job import logged

from reacher_shaping import artifacts, schemas

with logged(snakemake.log[0]):
    runs = [artifacts.read_table(path, schemas.PEERS) for path in snakemake.input]
    artifacts.write_table(snakemake.output[0], pd.concat(runs, ignore_index=True), schemas.PEERS)
