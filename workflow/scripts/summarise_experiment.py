"""What an experiment's runs show: logged curves, comparisons, correlations."""

import json

import pandas as pd
from job import logged

from reacher_shaping.analysis import comparisons, learning_curves, switch_effects
from reacher_shaping.report import paper_tables
from reacher_shaping.storage import block_schemas, schemas
from reacher_shaping.storage.files import read_table, write_table
from reacher_shaping.storage.provenance import unchanged

given, params, output = snakemake.input, snakemake.params, snakemake.output

with logged(snakemake):
    runs = read_table(given.runs, schemas.RUNS)
    blocks = zip(params.cells, given.progress, given.manifests, map(json.loads, params.asked), strict=True)
    parts = [read_table(unchanged(*file), block_schemas.PROGRESS).assign(**cell) for cell, *file in blocks]
    progress = pd.concat(parts, ignore_index=True)
    write_table(output.logs, switch_effects.logs_frame(progress), schemas.LOGS)
    logged_curves = learning_curves.curve_table(progress, column="logged_return")
    write_table(output.logged, logged_curves, schemas.CURVES)
    metrics = (*comparisons.METRICS, *comparisons.SPEED)
    compared = comparisons.comparison_frame(runs, metrics)
    write_table(output.comparisons, compared, schemas.COMPARISONS)
    published = paper_tables.published_cells(pd.read_csv(given.table2), pd.read_csv(given.table3))
    correlated = switch_effects.correlation_frame(runs, published, snakemake.wildcards.experiment)
    write_table(output.correlation, correlated, schemas.CORRELATION)
