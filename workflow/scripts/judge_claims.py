"""Hold the paper's claims to their tests."""

from pathlib import Path

import pandas as pd
import yaml
from job import logged

from reacher_shaping.analysis import claims
from reacher_shaping.analysis.baselines import untrained_success
from reacher_shaping.analysis.claim_formulas import Study
from reacher_shaping.analysis.sensitivity import sensitivity_frame
from reacher_shaping.report import paper_tables
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_table, write_table

given, protocol, output = snakemake.input, snakemake.params.protocol, snakemake.output

with logged(snakemake.log[0]):
    ledger = yaml.safe_load(Path(given.ledger).read_text(encoding="utf-8"))
    published = paper_tables.published_cells(pd.read_csv(given.table2), pd.read_csv(given.table3))
    runs = read_table(given.runs, schemas.RUNS)
    long = read_table(given.long_episodes, schemas.ALL_LONG_EPISODES)
    study = Study(
        runs=runs[runs["protocol"] == protocol],
        long_episodes=long[long["protocol"] == protocol],
        peers=read_table(given.peers[0], schemas.PEERS) if given.peers else None,
        untrained=untrained_success(read_table(given.controllers, schemas.CONTROLLERS), protocol),
    )
    parts = claims.judged(ledger, study, published)
    write_table(output.claims, claims.claims_frame(ledger, parts), schemas.CLAIMS)
    write_table(output.claim_parts, claims.parts_frame(parts), schemas.CLAIM_PARTS)
    write_table(output.family_error, claims.family_frame(parts), schemas.FAMILY_ERROR)
    radii = read_table(given.run_radii, schemas.RUN_RADII)
    write_table(output.sensitivity, sensitivity_frame(ledger, study, published, radii), schemas.SENSITIVITY)
