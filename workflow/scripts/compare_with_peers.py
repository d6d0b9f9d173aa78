"""An experiment's unshaped cells beside another implementation with the same settings."""

import pandas as pd
from job import logged

from reacher_shaping.analysis.baselines import agreement_frame
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_table, write_table

with logged(snakemake):
    runs = read_table(snakemake.input.runs, schemas.RUNS)
    peers = [read_table(path, schemas.PEERS) for path in snakemake.input.peers]
    runs = runs[runs["protocol"] == snakemake.params.protocol]
    agreement = agreement_frame(runs, pd.concat(peers, ignore_index=True))
    write_table(snakemake.output[0], agreement, schemas.AGREEMENT)
