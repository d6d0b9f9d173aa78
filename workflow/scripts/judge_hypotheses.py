"""Judge our own hypotheses on an experiment by the tests fixed before its runs."""

import json

import pandas as pd
from job import logged

from reacher_shaping.analysis import hypotheses
from reacher_shaping.storage import block_schemas, schemas
from reacher_shaping.storage.files import read_table, write_table
from reacher_shaping.storage.provenance import unchanged

given, params = snakemake.input, snakemake.params

with logged(snakemake):
    runs = read_table(given.runs, schemas.RUNS)
    blocks = zip(params.cells, given.progress, strict=True)
    parts = [read_table(unchanged(path), block_schemas.PROGRESS).assign(**cell) for cell, path in blocks]
    progress = pd.concat(parts, ignore_index=True)
    take_off = hypotheses.take_off_frame(progress)
    judged = hypotheses.verdicts(runs, take_off, json.loads(params.ledger))
    write_table(snakemake.output.hypotheses, judged, schemas.HYPOTHESES)
    write_table(snakemake.output.takeoff, hypotheses.take_off_curves(progress), schemas.TAKEOFF)
