"""Draw one view of an experiment."""

from pathlib import Path

import pandas as pd
from job import logged

from reacher_shaping.figures import drawing
from reacher_shaping.figures.style import save
from reacher_shaping.storage.reference import read_studies

given, wildcards = snakemake.input, snakemake.wildcards

with logged(snakemake):
    tables = read_studies(path for path in given if "/experiments/" in path)[wildcards.experiment]
    tables = {**tables, "training_logs": pd.read_csv(given.training_logs)}
    figure = drawing.draw(wildcards.view, tables, drawing.STUDY)
    save(figure, Path(snakemake.output[0]).with_suffix(""))
