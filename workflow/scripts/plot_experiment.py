"""Draw one view of an experiment."""

from pathlib import Path

import pandas as pd
from job import logged

from reacher_shaping import artifacts, experiment_figures, experiment_report

given, wildcards = snakemake.input, snakemake.wildcards

with logged(snakemake.log[0]):
    tables = experiment_report.read(path for path in given if "/experiments/" in path)[wildcards.experiment]
    main = artifacts.read_table(given.main[0], artifacts.CORRELATION) if given.main else None
    figure = experiment_figures.draw(wildcards.view, tables, pd.read_csv(given.training_logs), main)
    experiment_figures.save(figure, Path("figures") / f"{wildcards.experiment}_{wildcards.view}")
