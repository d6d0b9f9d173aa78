"""Correlate alpha0, success rate, mean return and budget, in our cells and in the published ones."""

import pandas as pd
from job import logged

from reacher_shaping.analysis.correlation import correlation_frame, correlations, in_table_2
from reacher_shaping.report import paper_tables
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_table, write_table

with logged(snakemake):
    runs = read_table(snakemake.input.runs, schemas.RUNS)
    published = paper_tables.published_cells(pd.read_csv(snakemake.input.table2), pd.read_csv(snakemake.input.table3))
    theirs = correlations(published[in_table_2(published)].assign(seed=0), "cells")
    write_table(snakemake.output.correlation, correlation_frame(runs), schemas.CORRELATION)
    write_table(snakemake.output.correlation_published, theirs.assign(protocol="published"), schemas.CORRELATION)
