"""Ask how far one seed per cell, or a few, would have carried, and what the published runs of one seed show."""

import pandas as pd
from job import logged

from reacher_shaping.analysis import comparisons, correlation, scores, single_seed_studies
from reacher_shaping.random_streams import generator
from reacher_shaping.report import paper_tables
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_table, write_table

given, params, output = snakemake.input, snakemake.params, snakemake.output

with logged(snakemake):
    runs = read_table(given.runs, schemas.RUNS)
    published = paper_tables.published_cells(pd.read_csv(given.table2), pd.read_csv(given.table3))
    write_table(output.correlation_published, correlation.of_published(published), schemas.CORRELATION)
    paper = runs[correlation.in_paper(runs)]
    write_table(output.variance, comparisons.variance_frame(paper), schemas.VARIANCE)
    write_table(output.power, comparisons.power_frame(paper, published), schemas.POWER)
    write_table(output.scores, scores.scores_frame(runs), schemas.SCORES)
    write_table(output.profiles, scores.profiles_frame(runs), schemas.PROFILES)
    random = generator(params.root_seed, "lottery")
    studies = single_seed_studies.single_seed_studies(paper[paper["protocol"] == params.protocol], random)
    write_table(output.lottery, single_seed_studies.lottery_frame(studies), schemas.LOTTERY)
    write_table(output.winners, single_seed_studies.winners_frame(studies), schemas.WINNERS)
    write_table(output.spread, single_seed_studies.spread_frame(studies), schemas.SPREAD)
