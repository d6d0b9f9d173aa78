"""Correlate alpha0, success rate, mean return and budget, in our cells and in the published ones."""

import pandas as pd
from job import logged

from reacher_shaping import aggregate, artifacts, schemas, tables

root_seed = snakemake.params.root_seed

with logged(snakemake.log[0]):
    runs = artifacts.read_table(snakemake.input.runs, schemas.RUNS)
    published = tables.published_cells(pd.read_csv(snakemake.input.table2), pd.read_csv(snakemake.input.table3))
    main_grid = published[aggregate.in_table_2(published)]
    theirs = aggregate.correlations(main_grid, "cells", aggregate.generator(root_seed, "published"))
    artifacts.write_table(snakemake.output.study, aggregate.correlation_frame(runs, root_seed), schemas.CORRELATION)
    artifacts.write_table(snakemake.output.published, theirs.assign(protocol="published"), schemas.CORRELATION)
