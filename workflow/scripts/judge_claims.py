"""Hold the paper's claims to their tests."""

from pathlib import Path

import pandas as pd
import yaml
from job import logged

from reacher_shaping import artifacts, claims, schemas, tables

given = snakemake.input

with logged(snakemake.log[0]):
    runs = artifacts.read_table(given.runs, schemas.RUNS)
    ledger = yaml.safe_load(Path(given.ledger).read_text(encoding="utf-8"))
    published = tables.published_cells(pd.read_csv(given.table2), pd.read_csv(given.table3))
    long = artifacts.read_table(given.long_episodes, schemas.ALL_LONG_EPISODES)
    peers = artifacts.read_table(given.peers[0], schemas.PEERS) if given.peers else None
    measured = claims.measure(runs, snakemake.params.root_seed, peers=peers, long_episodes=long)
    parts = claims.assess(ledger, measured, claims.published_estimates(published))
    artifacts.write_table(snakemake.output.parts, parts, schemas.CLAIM_PARTS)
    artifacts.write_table(snakemake.output.claims, claims.claims_frame(ledger, parts), schemas.CLAIMS)
