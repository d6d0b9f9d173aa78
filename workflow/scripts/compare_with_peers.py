"""An experiment's unshaped cells beside another implementation with the same settings."""

import pandas as pd
from job import logged

from reacher_shaping import artifacts, experiments, schemas

with logged(snakemake.log[0]):
    runs = artifacts.read_table(snakemake.input.runs, schemas.RUNS)
    peers = [artifacts.read_table(path, schemas.PEERS) for path in snakemake.input.peers]
    runs = runs[runs["protocol"] == snakemake.params.protocol]
    agreement = experiments.agreement_frame(runs, pd.concat(peers, ignore_index=True))
    artifacts.write_table(snakemake.output[0], agreement, schemas.AGREEMENT)
