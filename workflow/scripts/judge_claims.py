"""Hold the paper's claims to their tests."""

from pathlib import Path

import pandas as pd
import yaml
from job import logged

from reacher_shaping.analysis import claims
from reacher_shaping.report import paper_tables
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_table, write_table

given = snakemake.input

with logged(snakemake.log[0]):
    runs = read_table(given.runs, schemas.RUNS)
    ledger = yaml.safe_load(Path(given.ledger).read_text(encoding="utf-8"))
    published = paper_tables.published_cells(pd.read_csv(given.table2), pd.read_csv(given.table3))
    long = read_table(given.long_episodes, schemas.ALL_LONG_EPISODES)
    peers = read_table(given.peers[0], schemas.PEERS) if given.peers else None
    measured = claims.measure(runs, snakemake.params.root_seed, peers=peers, long_episodes=long)
    parts = claims.assess(ledger, measured, claims.published_estimates(published))
    write_table(snakemake.output.claim_parts, parts, schemas.CLAIM_PARTS)
    write_table(snakemake.output.claims, claims.claims_frame(ledger, parts), schemas.CLAIMS)
