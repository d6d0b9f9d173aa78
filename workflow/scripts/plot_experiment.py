"""Draw one view of an experiment."""

from pathlib import Path

import pandas as pd
from job import logged

from reacher_shaping import experiment_figures, experiments

given, wildcards = snakemake.input, snakemake.wildcards

with logged(snakemake.log[0]):
    tables = experiments.read(path for path in given if "/experiments/" in path)[wildcards.experiment]
    figure = experiment_figures.draw(wildcards.view, tables, pd.read_csv(given.training_logs))
    experiment_figures.save(figure, Path("figures") / f"{wildcards.experiment}_{wildcards.view}")
