"""An experiment's unshaped cells beside another implementation with the same settings."""

import json

import pandas as pd
from job import logged

from reacher_shaping.analysis.baselines import agreement_frame
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_table, write_table
from reacher_shaping.storage.provenance import unchanged

with logged(snakemake):
    runs = read_table(snakemake.input.runs, schemas.RUNS)
    files = zip(snakemake.input.peers, map(json.loads, snakemake.params.asked), strict=True)
    peers = [read_table(unchanged(path, asked=asked), schemas.PEERS) for path, asked in files]
    runs = runs[runs["protocol"] == snakemake.params.protocol]
    agreement = agreement_frame(runs, pd.concat(peers, ignore_index=True))
    write_table(snakemake.output[0], agreement, schemas.AGREEMENT)
