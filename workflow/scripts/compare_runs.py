"""Compare a study's cells on common seeds, and correlate what they are set to with what comes out."""

import pandas as pd
from job import logged

from reacher_shaping.analysis import comparisons, correlation
from reacher_shaping.report import paper_tables
from reacher_shaping.settings.study import MAIN
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_table, write_table

given, params, output = snakemake.input, snakemake.params, snakemake.output

with logged(snakemake):
    runs = read_table(given.runs, schemas.RUNS)
    published = paper_tables.published_cells(pd.read_csv(given.table2), pd.read_csv(given.table3))
    if params.study == MAIN:  # its tables hold what the paper asks: no learning speed, and each protocol by itself
        compared, correlated = comparisons.comparison_frame(runs), correlation.by_protocol(runs)
    else:
        compared = comparisons.comparison_frame(runs, (*comparisons.METRICS, *comparisons.SPEED))
        correlated = correlation.over_protocols(runs, published, params.study)
    write_table(output.comparisons, compared, schemas.COMPARISONS)
    write_table(output.correlation, correlated, schemas.CORRELATION)
