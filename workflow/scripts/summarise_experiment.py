"""What an experiment's runs show: logged curves, comparisons, correlations."""

import pandas as pd
from job import logged

from reacher_shaping import artifacts, comparisons, curves, experiments, schemas, tables
from reacher_shaping.provenance import unchanged

given, params, output = snakemake.input, snakemake.params, snakemake.output

with logged(snakemake.log[0]):
    runs = artifacts.read_table(given.runs, schemas.RUNS)
    blocks = zip(params.cells, given.progress, strict=True)
    parts = [artifacts.read_table(unchanged(path), schemas.PROGRESS).assign(**cell) for cell, path in blocks]
    progress = pd.concat(parts, ignore_index=True)
    artifacts.write_table(output.logs, experiments.logs_frame(progress), schemas.LOGS)
    logged_curves = curves.curve_table(progress, column="logged_return")
    artifacts.write_table(output.logged, logged_curves, schemas.CURVES)
    metrics = (*comparisons.METRICS, *comparisons.SPEED)
    compared = comparisons.comparison_frame(runs, params.root_seed, metrics)
    artifacts.write_table(output.comparisons, compared, schemas.COMPARISONS)
    published = tables.published_cells(pd.read_csv(given.table2), pd.read_csv(given.table3))
    correlated = experiments.correlation_frame(runs, published, snakemake.wildcards.experiment, params.root_seed)
    artifacts.write_table(output.correlation, correlated, schemas.CORRELATION)
