"""Hold the paper's claims to their tests, on the main study or on a further one; what that lacks is untested.

Of the tables that come of it those are written that the rule asks for.
"""

from pathlib import Path

import pandas as pd
import yaml
from job import logged

from reacher_shaping.analysis import claims
from reacher_shaping.analysis.baselines import untrained_success
from reacher_shaping.analysis.claim_formulas import Study, with_twins
from reacher_shaping.analysis.correlation import in_paper
from reacher_shaping.analysis.sensitivity import sensitivity_frame
from reacher_shaping.report import paper_tables
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_table, write_table
from reacher_shaping.storage.tables import TABLES

given, params, output = snakemake.input, snakemake.params, snakemake.output


def optional(name: str, file: str = "") -> pd.DataFrame | None:
    """A table of the study, or another `file` of the same kind, where the study has it."""
    path = given.get(file or name)
    return read_table(path, TABLES[name].schema) if path else None


with logged(snakemake):
    ledger = yaml.safe_load(Path(given.ledger).read_text(encoding="utf-8"))
    published = paper_tables.published_cells(pd.read_csv(given.table2), pd.read_csv(given.table3))
    runs = read_table(given.runs, schemas.RUNS)
    study = Study(
        runs=with_twins(runs[runs["protocol"].isin(params.protocols) & in_paper(runs)], params.twins),
        long_episodes=optional("long_episodes"),
        peers=read_table(given.peers[0], schemas.PEERS) if given.get("peers") else None,
        untrained=untrained_success(read_table(given.controllers, schemas.CONTROLLERS), params.protocols[0]),
    )
    second = None
    if given.get("second_runs"):
        long = optional("long_episodes", "second_long")
        again = Study(read_table(given.second_runs, schemas.RUNS), long, untrained=study.untrained)
        second = claims.interval_verdicts(claims.judged(ledger, again, published))
    parts = claims.judged(ledger, study, published)
    frames = {
        "claims": lambda: claims.claims_frame(ledger, parts, second),
        "claim_parts": lambda: claims.parts_frame(parts),
        "family_error": lambda: claims.family_frame(parts),
        "sensitivity": lambda: sensitivity_frame(ledger, study, published, optional("run_radii")),
    }
    for name, path in output.items():
        write_table(path, frames[name](), TABLES[name].schema)
