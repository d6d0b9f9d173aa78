"""Compare cells on common seeds, and ask how far one seed per cell, or a few, would have carried."""

import pandas as pd
from job import logged

from reacher_shaping import aggregate, artifacts, comparisons, lottery, schemas, tables

given, params, output = snakemake.input, snakemake.params, snakemake.output

with logged(snakemake.log[0]):
    runs = artifacts.read_table(given.runs, schemas.RUNS)
    published = tables.published_cells(pd.read_csv(given.table2), pd.read_csv(given.table3))
    compared = comparisons.comparison_frame(runs, params.root_seed)
    artifacts.write_table(output.comparisons, compared, schemas.COMPARISONS)
    artifacts.write_table(output.variance, comparisons.variance_frame(runs), schemas.VARIANCE)
    artifacts.write_table(output.power, comparisons.power_frame(runs, published), schemas.POWER)
    random = aggregate.generator(params.root_seed, "lottery")
    studies = lottery.single_seed_studies(runs[runs["protocol"] == params.protocol], random)
    artifacts.write_table(output.lottery, lottery.lottery_frame(studies), schemas.LOTTERY)
    artifacts.write_table(output.winners, lottery.winners_frame(studies), schemas.WINNERS)
    artifacts.write_table(output.spread, lottery.spread_frame(studies), schemas.SPREAD)
